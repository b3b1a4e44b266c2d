// SPDX-License-Identifier: Apache-2.0
#include "triangle_section.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace sarnerf {

TriangleSections::TriangleSections(const ViewRays& rays, std::span<const glm::vec3> vertices_m,
                                   std::span<const glm::uvec3> triangles,
                                   const glm::dvec3& scene_origin_m)
    : vertices_m_(vertices_m),
      triangles_(triangles),
      frame_(rays.grid.frame()),
      scene_from_aim_m_(scene_origin_m - rays.grid.acquisition().aim_m),
      slant_range_m_(rays.grid.acquisition().slant_range_m),
      fan_(rays.grid.fan()) {}

std::optional<std::pair<double, double>> TriangleSections::rays_of(std::uint32_t triangle,
                                                                   double along_m) const {
  const glm::uvec3 corners = triangles_[triangle];
  std::array<glm::dvec3, 3> p;  // (along h − a, along v, along k)
  for (int n = 0; n < 3; ++n) {
    const glm::dvec3 q = glm::dvec3(vertices_m_[corners[n]]) + scene_from_aim_m_;
    p[static_cast<std::size_t>(n)] = {glm::dot(q, frame_.h) - along_m, glm::dot(q, frame_.v),
                                      glm::dot(q, frame_.k)};
  }
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (std::size_t n = 0; n < 3; ++n) {
    const glm::dvec3 &from = p[n], &to = p[(n + 1) % 3];
    if ((from.x < 0.0) == (to.x < 0.0)) continue;
    const double fraction = from.x / (from.x - to.x);
    const double v = from.y + fraction * (to.y - from.y);
    const double depth = slant_range_m_ + from.z + fraction * (to.z - from.z);
    const double k = (std::atan2(v, depth) - fan_.first_angle_rad) / fan_.step_rad - 0.5;
    first = std::min(first, k);
    last = std::max(last, k);
  }
  if (!(first <= last)) return std::nullopt;
  return std::pair{first, last};
}

}  // namespace sarnerf
