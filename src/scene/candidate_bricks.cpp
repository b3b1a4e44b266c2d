// SPDX-License-Identifier: Apache-2.0
#include "candidate_bricks.h"

#include <algorithm>

namespace sarnerf {

void CandidateBricks::add(const glm::ivec3& brick, std::uint32_t surface) {
  const std::uint32_t number = bricks_.insert(brick);
  if (number == surfaces_.size()) surfaces_.emplace_back();
  // Surfaces come one after the other, so that one that is there already is the last.
  std::vector<std::uint32_t>& known = surfaces_[number];
  if (known.empty() || known.back() != surface) known.push_back(surface);
}

void CandidateBricks::add_triangle(const glm::dvec3& a_m, const glm::dvec3& b_m,
                                   const glm::dvec3& c_m, double margin, std::uint32_t surface) {
  add_part(transform_.index_from_world(a_m), transform_.index_from_world(b_m),
           transform_.index_from_world(c_m), margin, surface);
}

void CandidateBricks::add_part(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                               double margin, std::uint32_t surface) {
  const double ab = glm::length(b - a), bc = glm::length(c - b), ca = glm::length(a - c);
  const double longest = std::max({ab, bc, ca});
  if (longest > kBrickSide) {  // halves: boxes of oblique triangles are mostly empty
    const glm::dvec3 p = longest == ab ? a : longest == bc ? b : c;
    const glm::dvec3 q = longest == ab ? b : longest == bc ? c : a;
    const glm::dvec3 r = longest == ab ? c : longest == bc ? a : b;
    const glm::dvec3 middle = 0.5 * (p + q);
    add_part(p, middle, r, margin, surface);
    add_part(middle, q, r, margin, surface);
    return;
  }
  const glm::ivec3 low = brick_of_voxel(glm::ivec3(glm::ceil(glm::min(a, glm::min(b, c)) - margin)));
  const glm::ivec3 high = brick_of_voxel(glm::ivec3(glm::floor(glm::max(a, glm::max(b, c)) + margin)));
  for (int x = low.x; x <= high.x; ++x) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int z = low.z; z <= high.z; ++z) add({x, y, z}, surface);
    }
  }
}

}  // namespace sarnerf
