// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace sarnerf {

/// The surface of a solid: triangles in world coordinates (m), counter-clockwise seen from outside.
struct SurfaceMesh {
  std::vector<glm::dvec3> vertices_m;
  std::vector<glm::uvec3> triangles;
};

}  // namespace sarnerf
