// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <span>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// Cells of eight voxels around a block of points: the lowest of the eight, and where in the cell the
/// point lies. An array per number, so that the loops that fill them are vectorised.
struct Cells {
  static constexpr std::size_t kCapacity = 128;
  std::array<int, kCapacity> voxel[3];
  std::array<float, kCapacity> fraction[3];
};

/// One coordinate of the cells. Points that are not finite or beyond reach get a cell beyond reach, where no
/// brick can be.
inline void find_cells_along(double origin_m, double voxels_per_m,
                             const float* __restrict coordinate_m, std::size_t n_points,
                             int* __restrict voxel, float* __restrict fraction) {
  constexpr double kBeyond = 8.0 * (kMaxBrick + 2);
  for (std::size_t n = 0; n < n_points; ++n) {
    const double exact = (static_cast<double>(coordinate_m[n]) - origin_m) * voxels_per_m;
    const double index = std::abs(exact) < kBeyond ? exact : kBeyond;  // NaN, too, is beyond
    // std::floor, which is a call on processors before SSE 4.1 and keeps the loop from being vectorised:
    // adding 1.5 · 2⁵² rounds to the nearest integer.
    const double nearest = (index + 0x1.8p52) - 0x1.8p52;
    const double low = index < nearest ? nearest - 1.0 : nearest;
    voxel[n] = static_cast<int>(low);
    fraction[n] = static_cast<float>(index - low);
  }
}

inline void find_cells(const GridTransform& transform, std::span<const glm::vec3> points_m,
                       Cells& cells) {
  std::array<float, Cells::kCapacity> coordinate_m[3];
  for (std::size_t n = 0; n < points_m.size(); ++n) {
    coordinate_m[0][n] = points_m[n].x;
    coordinate_m[1][n] = points_m[n].y;
    coordinate_m[2][n] = points_m[n].z;
  }
  const double origin_m[3] = {transform.origin_m.x, transform.origin_m.y, transform.origin_m.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    find_cells_along(origin_m[axis], 1.0 / transform.voxel_size_m, coordinate_m[axis].data(),
                     points_m.size(), cells.voxel[axis].data(), cells.fraction[axis].data());
  }
}

}  // namespace sarnerf
