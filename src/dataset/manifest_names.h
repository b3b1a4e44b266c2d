// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

namespace sarnerf {

inline constexpr std::string_view kManifestFormat = "sarnerf-dataset";
inline constexpr int kManifestVersion = 1;

/// In the order of enum class Axis.
inline constexpr std::array<std::string_view, 4> kAxisNames{"+i", "-i", "+j", "-j"};

/// In the order of enum class Look.
inline constexpr std::array<std::string_view, 2> kLookNames{"right", "left"};

}  // namespace sarnerf
