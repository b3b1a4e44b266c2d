// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// What return_maps() of a box (in the frame of the views' aim points) holds for so many views, with the lists of returns
/// that are made of them.
std::uint64_t return_map_bytes(std::span<const Acquisition> views, const Box& box_m, double spacing_m);

/// What such maps leave of the memory that is allowed; 0 where all is (0: unlimited). Throws UsageError where they leave
/// nothing.
std::uint64_t memory_beside_maps(std::span<const Acquisition> views, const Box& box_m, double spacing_m,
                                 std::uint64_t max_memory_bytes);

}  // namespace sarnerf
