// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Red, green, blue.
using Colour = std::array<std::uint8_t, 3>;

/// Values as colours that grow evenly brighter (viridis), from `low` (dark violet) to `high` (yellow);
/// clamped beyond. What is not finite is black.
Image<Colour> colour_map(const Image<float>& values, float low, float high);

/// The bytes of an 8-bit colour PNG.
std::vector<std::byte> encode_png(const Image<Colour>& picture);

}  // namespace sarnerf
