// SPDX-License-Identifier: Apache-2.0
#include "triangle_subset.h"

namespace sarnerf {

TriangleSubset take_triangles(const Mesh& mesh, std::span<const std::uint32_t> chosen,
                              const glm::dvec3& origin_m) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> new_index(mesh.vertices_m.size(), kUnused);
  TriangleSubset subset;
  subset.triangles.reserve(chosen.size());
  for (const std::uint32_t triangle : chosen) {
    glm::uvec3 corners = mesh.triangles[triangle];
    for (int c = 0; c < 3; ++c) {
      std::uint32_t& index = new_index[corners[c]];
      if (index == kUnused) {
        index = static_cast<std::uint32_t>(subset.vertices_m.size());
        subset.vertices_m.emplace_back(mesh.vertices_m[corners[c]] - origin_m);
      }
      corners[c] = index;
    }
    subset.triangles.push_back(corners);
  }
  subset.vertices_m.emplace_back(0.0f);
  return subset;
}

}  // namespace sarnerf
