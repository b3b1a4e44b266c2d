// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "triangle_soup.h"

namespace sarnerf {

/// Joins vertices on open borders that only rounding has separated: closer than four millionths of the
/// mesh's diagonal, and than a hundredth of the shortest border edge at either. That is what single
/// precision leaves after a few transforms; modellers cut no gaps of that size. Inner vertices never
/// move, and faces of different media (weld_vertices() has parted them) are not joined. Returns how many
/// vertices went. Linear time.
std::uint64_t stitch_borders(TriangleSoup& soup, std::span<const std::uint32_t> medium_of_material);

}  // namespace sarnerf
