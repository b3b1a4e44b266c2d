// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "sarnerf/bake/surface_mesh.h"

namespace sarnerf {

/// A point on a surface.
struct SurfaceSample {
  glm::dvec3 point_m;
  glm::dvec3 normal;  ///< outward, unit length
  std::uint32_t triangle;
};

/// n points that stand for equal areas each: one per n-th of the surface's area, triangle after triangle, spread
/// within strata and triangles by a sequence of low discrepancy. Always the same for the same mesh; none when it
/// has no area. Expects corners that exist and finite coordinates.
std::vector<SurfaceSample> sample_surface(const SurfaceMesh& mesh, std::size_t n);

}  // namespace sarnerf
