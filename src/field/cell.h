// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// The cell of eight voxels around a point: the lowest of them, and where in the cell the point lies.
struct Cell {
  glm::ivec3 voxel{0};
  glm::dvec3 fraction{0.0};
  bool valid = false;  ///< the point is finite and within 2³⁰ voxels
};

/// Finds cells of points. Multiplies by the inverse of the voxel size: divisions would cost as much as the
/// rest of a sample.
class CellFinder {
 public:
  explicit CellFinder(const GridTransform& transform)
      : origin_m_(transform.origin_m), voxels_per_m_(1.0 / transform.voxel_size_m) {}

  Cell at(const glm::dvec3& point_m) const {
    constexpr double kFar = 1073741824.0;
    const glm::dvec3 index = (point_m - origin_m_) * voxels_per_m_;
    if (!(std::abs(index.x) < kFar && std::abs(index.y) < kFar && std::abs(index.z) < kFar)) return {};
    // Towards minus infinity, without the call that std::floor is on processors before SSE 4.1.
    glm::ivec3 low(index);
    for (int axis = 0; axis < 3; ++axis) low[axis] -= index[axis] < low[axis] ? 1 : 0;
    return {low, index - glm::dvec3(low), true};
  }

 private:
  glm::dvec3 origin_m_;
  double voxels_per_m_;
};

/// Corner n of a cell is at voxel + corner_step(n): z in the lowest bit, as voxels lie in memory.
inline glm::ivec3 corner_step(int n) { return {n >> 2 & 1, n >> 1 & 1, n & 1}; }

}  // namespace sarnerf
