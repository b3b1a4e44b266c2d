// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "sarnerf/core/format.h"      // counted()
#include "sarnerf/core/input_text.h"  // in_quotes()

/// Wording shared by notes, warnings and errors.
namespace sarnerf {

/// 1500000000 → "1.5 GB"; decimal units, three digits at most.
std::string human_bytes(std::uint64_t bytes);

/// Shortest text that reads back as the same number.
std::string number_text(double value);

/// "asphalt, brick, concrete"; after `limit` names "… (12 more)". Names are kept to one line and 60 bytes.
std::string listed(std::span<const std::string> names, std::size_t limit = 40);

}  // namespace sarnerf
