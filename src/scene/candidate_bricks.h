// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// Bricks that surfaces may reach, each with the surfaces that may reach it.
class CandidateBricks {
 public:
  explicit CandidateBricks(const GridTransform& transform) : transform_(transform) {}

  /// Adds all bricks with a voxel within `margin` voxels of a triangle, and some more. Cost: the
  /// triangle's area over that of a brick.
  void add_triangle(const glm::dvec3& a_m, const glm::dvec3& b_m, const glm::dvec3& c_m,
                    double margin, std::uint32_t surface);
  void add(const glm::ivec3& brick, std::uint32_t surface);

  const BrickTopology& bricks() const { return bricks_; }
  const std::vector<std::uint32_t>& surfaces(std::uint32_t brick) const { return surfaces_[brick]; }

 private:
  void add_part(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double margin,
                std::uint32_t surface);

  GridTransform transform_;
  BrickTopology bricks_;
  std::vector<std::vector<std::uint32_t>> surfaces_;  ///< per brick
};

}  // namespace sarnerf
