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

inline Cell cell_at(const GridTransform& transform, const glm::dvec3& point_m) {
  constexpr double kFar = 1073741824.0;
  const glm::dvec3 index = transform.index_from_world(point_m);
  if (!(std::abs(index.x) < kFar && std::abs(index.y) < kFar && std::abs(index.z) < kFar)) return {};
  const glm::dvec3 low = glm::floor(index);
  return {glm::ivec3(low), index - low, true};
}

/// Corner n of a cell is at voxel + corner_step(n): z in the lowest bit, as voxels lie in memory.
inline glm::ivec3 corner_step(int n) { return {n >> 2 & 1, n >> 1 & 1, n & 1}; }

}  // namespace sarnerf
