// SPDX-License-Identifier: Apache-2.0
#include "standing_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sarnerf/geometry/level_plane.h"
#include "sarnerf/geometry/ray_grid.h"

namespace sarnerf {
namespace {

/// Room at the borders: matter begins up to some voxels above the plane.
constexpr int kMargin_bins = 4;

/// Ray angle at which each bin sees the plane; −∞ in bins nearer than the plane.
std::vector<double> plane_angles(const Acquisition& a, double height_m) {
  const RadarFrame frame = radar_frame(a);
  const glm::dvec3 away = level_range_direction(a);
  std::vector<double> angles;
  for (const double offset_m : plane_offsets_m(a, height_m)) {
    const glm::dvec3 point_m = offset_m * away + glm::dvec3(0.0, height_m, 0.0);
    angles.push_back(std::isnan(offset_m) ? -std::numeric_limits<double>::infinity()
                                          : project(a, frame, point_m).ray_angle_rad);
  }
  return angles;
}

}  // namespace

StandingView standing_view(const Acquisition& a, const Box& standing_m, double ground_height_m) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (standing_m.empty()) return {-kInfinity, kInfinity, 0, 0};
  const RadarFrame frame = radar_frame(a);
  double nearest_m = kInfinity;
  for (const glm::dvec3& corner : standing_m.corners())
    nearest_m = std::min(nearest_m, project(a, frame, corner).range_offset_m);
  const std::vector<double> angle = plane_angles(a, ground_height_m);
  const double last_angle = angular_extent(a, standing_m).second;
  const auto shadow_end = static_cast<int>(std::upper_bound(angle.begin(), angle.end(), last_angle) - angle.begin());

  const auto nearest_bin = static_cast<int>(std::floor(
      std::clamp(nearest_m / a.range_spacing_m + 0.5 * (a.n_range - 1), 0.0, double(a.n_range))));
  StandingView view{-kInfinity, kInfinity, std::max(0, nearest_bin - kMargin_bins),
                    std::min(a.n_range, shadow_end + kMargin_bins)};
  if (view.first_bin >= kMargin_bins)
    view.least_angle_rad = angle[static_cast<std::size_t>(view.first_bin - kMargin_bins)];
  if (view.end_bin + kMargin_bins < a.n_range)
    view.most_angle_rad = angle[static_cast<std::size_t>(view.end_bin + kMargin_bins)];
  return view;
}

}  // namespace sarnerf
