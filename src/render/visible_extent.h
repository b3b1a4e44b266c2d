// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include "sarnerf/geometry/ray_grid.h"

namespace sarnerf {

/// The scene's box as one radar sees it, to leave out every ray that cannot matter: those that miss
/// the box, and those that meet only its part beyond the last range bin. Matter nearer than bin 0 is
/// kept, it casts shadows.
class VisibleExtent {
 public:
  VisibleExtent(const Acquisition& acquisition, const Box& box);

  /// Range of ray angles (rad) that meet the visible part of the box at along-track coordinates in
  /// [first, last] (m); empty when none do. Conservative by less than a ray.
  std::optional<std::pair<double, double>> angles(double first_along_m, double last_along_m) const;

  /// Along-track extent of the box (m, relative to the aim point).
  std::pair<double, double> along_track_m() const { return {corner_min_.x, corner_max_.x}; }

  /// Range offsets s = t − r (m) between which all of the box lies.
  std::pair<double, double> range_offsets_m() const { return range_offsets_m_; }

 private:
  Acquisition acquisition_;
  std::array<glm::dvec3, 8> corners_;  ///< (along h, along v, along k) relative to the aim point
  glm::dvec3 corner_min_{0.0}, corner_max_{0.0};
  std::pair<double, double> range_offsets_m_{0.0, 0.0};
  double last_depth_m_ = 0.0;  ///< along k, beyond which nothing reaches the last bin
};

/// Ray indices [first, first + count).
struct RayRange {
  int first = 0;
  int count = 0;
};

/// The rays inside the angles (rad), with one to spare on each side; none without angles.
RayRange rays_inside(const Fan& fan, const std::optional<std::pair<double, double>>& angles);

}  // namespace sarnerf
