// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// Some triangles of a mesh in single precision around an origin of their own: what Embree takes.
struct TriangleSubset {
  std::vector<glm::vec3> vertices_m;  ///< one more than are used, see RayTracer
  std::vector<glm::uvec3> triangles;
};

/// Only vertices that the chosen triangles use are kept. Differences to the origin are formed in
/// double precision, so that scenes in UTM coordinates lose nothing.
TriangleSubset take_triangles(const Mesh& mesh, std::span<const std::uint32_t> chosen,
                              const glm::dvec3& origin_m);

/// The vertices without the padding element.
inline std::span<const glm::vec3> vertices(const std::vector<glm::vec3>& padded) {
  return std::span(padded).first(padded.size() - 1);
}

}  // namespace sarnerf
