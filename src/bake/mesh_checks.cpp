// SPDX-License-Identifier: Apache-2.0
#include "mesh_checks.h"

#include <cmath>

#include "sarnerf/core/error.h"

namespace sarnerf {

Box checked_box(const SurfaceMesh& mesh, const std::string& name) {
  const std::size_t n_vertices = mesh.vertices_m.size();
  for (std::size_t v = 0; v < n_vertices; ++v) {
    const glm::dvec3& p = mesh.vertices_m[v];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) continue;
    throw InputError(name + ": vertex " + std::to_string(v) + " is not finite; expected coordinates in metres");
  }
  Box box;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t v = mesh.triangles[t][corner];
      if (v >= n_vertices) {
        throw InputError(name + ": triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) + " of " +
                         std::to_string(n_vertices) + ", counted from 0");
      }
      box.include(mesh.vertices_m[v]);
    }
  }
  return box;
}

}  // namespace sarnerf
