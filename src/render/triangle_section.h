// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <utility>

#include "view_rays.h"

namespace sarnerf {

/// Where a slice's plane cuts a triangle, as an interval of (fractional) ray indices k: ray k runs at
/// k, the border between rays k and k + 1 is somewhere in between. Exact, so that the outline of a
/// face is known far better than the spacing of the rays.
class TriangleSections {
 public:
  TriangleSections(const ViewRays& rays, std::span<const glm::vec3> vertices_m,
                   std::span<const glm::uvec3> triangles, const glm::dvec3& scene_origin_m);

  /// Empty when the plane at along-track coordinate a misses the triangle.
  std::optional<std::pair<double, double>> rays_of(std::uint32_t triangle, double along_m) const;

 private:
  std::span<const glm::vec3> vertices_m_;
  std::span<const glm::uvec3> triangles_;
  RadarFrame frame_;
  glm::dvec3 scene_from_aim_m_;
  double slant_range_m_;
  Fan fan_;
};

}  // namespace sarnerf
