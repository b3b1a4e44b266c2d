// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

/// The rays of one view in the form that tracing and deposit want: float arrays per component, origins
/// just before the scene's box instead of at the radar, in the scene frame (world axes, origin at
/// `scene_origin_m`). Made once per view; a slice only adds its along-track offset.
struct ViewRays {
  ViewRays(const Acquisition& acquisition, const Fan& fan, const glm::dvec3& scene_origin_m,
           std::pair<double, double> range_offsets_m);

  RayGrid grid;
  double start_offset_m;  ///< range offset s = t − r of all ray origins
  float far_m;            ///< length of the rays

  std::vector<double> origin_x, origin_y, origin_z;           ///< [n_el] on the row a = 0
  std::vector<float> direction_x, direction_y, direction_z;   ///< [n_el] d_k
  std::vector<float> turn_x, turn_y, turn_z;                  ///< [n_el] ∂d_k/∂δ

  /// Point of the scene frame at along-track coordinate a and range offset s.
  glm::dvec3 scene_point(double a_m, double s_m, int k) const {
    const auto n = static_cast<std::size_t>(k);
    return glm::dvec3(origin_x[n], origin_y[n], origin_z[n]) + a_m * grid.frame().h +
           (s_m - start_offset_m) * grid.direction(k);
  }

  /// Bin coordinate x of a range offset: bin j covers [j, j + 1).
  double bin_coordinate(double s_m) const {
    const Acquisition& a = grid.acquisition();
    return s_m / a.range_spacing_m + 0.5 * a.n_range;
  }
};

}  // namespace sarnerf
