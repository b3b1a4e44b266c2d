// SPDX-License-Identifier: Apache-2.0
#include "layer_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sarnerf {

LayerView::LayerView(const Acquisition& acquisition, const Fan& fan, double reference_height_m)
    : acquisition_(acquisition), fan_(fan), above_plane_m_(acquisition.aim_m.y - reference_height_m) {
  const double height_of_radar_m = acquisition.altitude_m() + above_plane_m_;
  for (int j = 0; j < acquisition.n_range; ++j) {
    const double cosine = height_of_radar_m / acquisition.range_m(j);
    if (cosine > 1.0 || cosine <= 0.0) {
      plane_ray_.push_back(-std::numeric_limits<double>::infinity());
      continue;
    }
    const double delta = std::acos(cosine) - acquisition.incidence_rad;
    plane_ray_.push_back((delta - fan.first_angle_rad) / fan.step_rad - 0.5);
  }
}

double LayerView::height_m(double k, double x) const {
  const double theta = acquisition_.incidence_rad, delta = fan_.ray_angle_rad(k);
  const double offset_m = (x - 0.5 * acquisition_.n_range) * acquisition_.range_spacing_m;
  // H − (r + s) cos(θ + δ), with the difference of cosines as a product.
  return above_plane_m_ +
         2.0 * acquisition_.slant_range_m * std::sin(theta + 0.5 * delta) * std::sin(0.5 * delta) -
         offset_m * std::cos(theta + delta);
}

double LayerView::plane_bin(double k) const {
  const double cosine = std::cos(incidence_rad(k));
  if (incidence_rad(k) <= 0.0 || cosine <= 1e-9) return std::numeric_limits<double>::infinity();
  const double offset_m = height_m(k, 0.5 * acquisition_.n_range) / cosine;
  return offset_m / acquisition_.range_spacing_m + 0.5 * acquisition_.n_range;
}

std::pair<int, int> LayerView::plane_bins(double first_ray, double last_ray) const {
  const auto first = std::lower_bound(plane_ray_.begin(), plane_ray_.end(), first_ray);
  const auto last = std::lower_bound(first, plane_ray_.end(), last_ray);
  return {static_cast<int>(first - plane_ray_.begin()), static_cast<int>(last - plane_ray_.begin())};
}

}  // namespace sarnerf
