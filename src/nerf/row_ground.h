// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>

#include "row_part.h"
#include "sarnerf/nerf/level_ground.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// Rays through a box end where they meet the ground.
inline void end_at(const LevelGround& ground, Box& box_m) {
  if (!box_m.empty()) box_m.min.y = std::max(box_m.min.y, ground.height_m);
}

/// Adds to a row's pixels what its rays leave of the ground's image: S_j = T at the angle under which bin j sees the
/// ground, linear between the rays of the fan, of three places in the bin. Rays that were not made, since they miss all
/// matter, have T = 1.
void add_ground(const RowPart& part, const RowPart::Row& row, const LevelGround& ground, const RaySampling& sampling,
                std::span<float> pixels);

/// Its adjoint: adds ∂L/∂κ of the row's segments, from ∂L/∂pixel, to part.d_extinction.
void add_ground_adjoint(RowPart& part, const RowPart::Row& row, const LevelGround& ground, const RaySampling& sampling,
                        std::span<const float> pixel_gradients);

}  // namespace sarnerf
