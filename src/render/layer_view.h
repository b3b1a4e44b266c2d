// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/geometry/ray_grid.h"

namespace sarnerf {

/// Where the pixels of one view are in space, and where the reference plane is among them: what layers
/// need to know of a view. Rays have real-valued coordinates k here, the ray itself at whole ones.
class LayerView {
 public:
  LayerView(const Acquisition& acquisition, const Fan& fan, double reference_height_m);

  int n_range() const { return acquisition_.n_range; }
  double range_spacing_m() const { return acquisition_.range_spacing_m; }

  /// Height above the reference plane (m) of the point on ray coordinate k at bin coordinate x.
  double height_m(double k, double x) const;

  /// Angle between ray k and the vertical (rad).
  double incidence_rad(double k) const { return acquisition_.incidence_rad + fan_.ray_angle_rad(k); }

  /// Bin coordinate at which ray k meets the reference plane; infinite if it does not.
  double plane_bin(double k) const;

  /// Ray coordinate of the reference plane's point in the middle of bin j, ascending with j; −infinity for
  /// bins nearer than the plane.
  double plane_ray(int j) const { return plane_ray_[static_cast<std::size_t>(j)]; }

  /// Bins [first, second) whose reference-plane points lie between two ray coordinates.
  std::pair<int, int> plane_bins(double first_ray, double last_ray) const;

 private:
  Acquisition acquisition_;
  Fan fan_;
  double above_plane_m_;           ///< height of the aim point above the reference plane
  std::vector<double> plane_ray_;  ///< [n_range]
};

}  // namespace sarnerf
