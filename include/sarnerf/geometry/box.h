// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <limits>

namespace sarnerf {

/// Axis-aligned box in world coordinates (m). Default-constructed it is empty.
struct Box {
  glm::dvec3 min{std::numeric_limits<double>::infinity()};
  glm::dvec3 max{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  glm::dvec3 centre() const { return 0.5 * (min + max); }
  glm::dvec3 size() const { return max - min; }

  void include(const glm::dvec3& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }

  std::array<glm::dvec3, 8> corners() const {
    std::array<glm::dvec3, 8> c;
    for (int n = 0; n < 8; ++n) {
      c[static_cast<std::size_t>(n)] = {n & 1 ? max.x : min.x, n & 2 ? max.y : min.y,
                                        n & 4 ? max.z : min.z};
    }
    return c;
  }
};

}  // namespace sarnerf
