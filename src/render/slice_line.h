// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// The cut of a slice's plane through a flat face: a straight line between two points of the plane that holds
/// all rays of the slice. Points have a depth along k and a coordinate along v, relative to the aim point (m).
/// Rays are named by the tangent of their angle δ, in which 1 / (r + depth) is linear along any line: so two
/// lines change places at most once.
struct SliceLine {
  double first, last;               ///< tangents of the rays through its ends, first < last
  double depth_m, across_m;         ///< its end at `first`: along k, along v
  double depth_step_m, across_step_m;  ///< from there to its other end
  std::uint32_t face;

  /// Fraction of the way along the line at which the ray meets it; `r` is the aim point's slant range (m). No
  /// cancellation for far radars: (r + depth) · tangent is as small as the scene.
  double fraction_at(double tangent, double r) const {
    const double f = ((r + depth_m) * tangent - across_m) / (across_step_m - depth_step_m * tangent);
    return std::clamp(f, 0.0, 1.0);
  }
  double depth_at(double tangent, double r) const { return depth_m + fraction_at(tangent, r) * depth_step_m; }
};

/// The scene's vertices as the radar of a view sees them: along h, along v, along k, relative to the aim
/// point (m). Throws GeometryError for a scene that reaches behind the radar.
std::vector<glm::dvec3> radar_vertices(const Scene& scene, const Acquisition& view);

/// Triangles of a scene, sorted by the image rows that they are part of.
class SlicedFaces {
 public:
  /// `vertices_m`: radar_vertices(); `triangles`: indices into scene.mesh.triangles. Scene and vertices must
  /// outlive it.
  SlicedFaces(const Scene& scene, std::span<const glm::dvec3> vertices_m,
              const std::vector<std::uint32_t>& triangles, const Acquisition& view);

  /// Replaces `lines` by the cuts of the plane at along-track coordinate a, inside row i; `face` is the index of
  /// the triangle in the mesh. Neighbours share their ends to the last bit, so that no ray slips between them.
  void cut(int i, double along_m, std::vector<SliceLine>& lines) const;

 private:
  const Scene& scene_;
  std::span<const glm::dvec3> vertices_m_;
  double slant_range_m_;
  std::vector<std::vector<std::uint32_t>> of_row_;
};

}  // namespace sarnerf
