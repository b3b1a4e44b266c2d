// SPDX-License-Identifier: Apache-2.0
#include "slice_line.h"

#include <cmath>
#include <cstdio>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Faces seen so nearly edge-on that their ends are this close (m) across the rays have no place of their own.
constexpr double kThinnest_m = 1e-10;

}  // namespace

std::vector<glm::dvec3> radar_vertices(const Scene& scene, const Acquisition& view) {
  const RadarFrame frame = radar_frame(view);
  std::vector<glm::dvec3> seen;
  seen.reserve(scene.mesh.vertices_m.size());
  for (const glm::dvec3& world_m : scene.mesh.vertices_m) {
    const glm::dvec3 q = world_m - view.aim_m;
    seen.push_back({glm::dot(q, frame.h), glm::dot(q, frame.v), glm::dot(q, frame.k)});
    if (view.slant_range_m + seen.back().z <= 0.0) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "the scene reaches behind the radar, which is %.6g m from the aim point: raise the altitude "
                    "or check the scene's units",
                    view.slant_range_m);
      throw GeometryError(text);
    }
  }
  return seen;
}

SlicedFaces::SlicedFaces(const Scene& scene, std::span<const glm::dvec3> vertices_m,
                         const std::vector<std::uint32_t>& triangles, const Acquisition& view)
    : scene_(scene),
      vertices_m_(vertices_m),
      slant_range_m_(view.slant_range_m),
      of_row_(static_cast<std::size_t>(view.n_azimuth)) {
  const double start_m = view.row_offset_m(-0.5), last_row = view.n_azimuth - 1.0;
  // Slices near a row's border may be rounded across it.
  constexpr double kSlack = 1e-6;
  for (const std::uint32_t t : triangles) {
    const glm::uvec3& corners = scene.mesh.triangles[t];
    const auto [low_m, high_m] = std::minmax({vertices_m[corners.x].x, vertices_m[corners.y].x, vertices_m[corners.z].x});
    const double first = std::max(0.0, std::floor((low_m - start_m) / view.azimuth_spacing_m - kSlack));
    const double last = std::min(last_row, std::floor((high_m - start_m) / view.azimuth_spacing_m + kSlack));
    for (double i = first; i <= last; ++i) of_row_[static_cast<std::size_t>(i)].push_back(t);
  }
}

void SlicedFaces::cut(int i, double along_m, std::vector<SliceLine>& lines) const {
  lines.clear();
  const double r = slant_range_m_;
  for (const std::uint32_t t : of_row_[static_cast<std::size_t>(i)]) {
    const glm::uvec3& corners = scene_.mesh.triangles[t];
    glm::dvec2 ends[2];  // across, depth
    int n_ends = 0;
    for (int c = 0; c < 3; ++c) {
      const glm::dvec3& p = vertices_m_[corners[c]];
      const glm::dvec3& q = vertices_m_[corners[(c + 1) % 3]];
      const bool p_before = p.x < along_m, q_before = q.x < along_m;
      if (p_before == q_before) continue;
      // From the same end in both triangles of an edge.
      const glm::dvec3 &from = p_before ? p : q, &to = p_before ? q : p;
      const double fraction = (along_m - from.x) / (to.x - from.x);
      ends[n_ends++] = glm::dvec2(from.y, from.z) + fraction * (glm::dvec2(to.y, to.z) - glm::dvec2(from.y, from.z));
    }
    if (n_ends != 2) continue;
    double first = ends[0].x / (r + ends[0].y), last = ends[1].x / (r + ends[1].y);
    if (first > last) {
      std::swap(first, last);
      std::swap(ends[0], ends[1]);
    }
    if (!((last - first) * r > kThinnest_m)) continue;
    lines.push_back({first, last, ends[0].y, ends[0].x, ends[1].y - ends[0].y, ends[1].x - ends[0].x, t});
  }
}

}  // namespace sarnerf
