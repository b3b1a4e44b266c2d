// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "sarnerf/dataset/evaluation.h"

namespace sarnerf::app {

/// The distance of --lpips; empty without a file. Images that are too small for the network have none: see
/// lpips_missing(). Throws InputError for a bad file.
ImageDistance load_lpips(const std::filesystem::path& weights);

/// Why these views have no LPIPS; empty where they have it.
std::string lpips_missing(const std::filesystem::path& weights, std::span<const PosedImage> views);

}  // namespace sarnerf::app
