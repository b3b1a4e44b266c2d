// SPDX-License-Identifier: Apache-2.0
#include "ground_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deposit.h"

namespace sarnerf {

GroundRays::GroundRays(const ViewRays& rays, const Appearance& appearance, double height_m)
    : rays_(rays), appearance_(appearance) {
  const Acquisition& a = rays.grid.acquisition();
  const Fan& fan = rays.grid.fan();
  const double theta = a.incidence_rad, r = a.slant_range_m;
  const double above_ground_m = a.aim_m.y - height_m;  // of the aim point
  // Range offset of the plane at a ray angle; infinite at and beyond the horizon, and behind the nadir.
  const auto offset_at = [&](double delta) {
    const double incidence = theta + delta, cosine = std::cos(incidence);
    if (incidence <= 0.0 || cosine <= 1e-9) return std::numeric_limits<double>::infinity();
    // t − r = (H − r cos(θ + δ)) / cos(θ + δ), with the difference of cosines as a product.
    return (above_ground_m + 2.0 * r * std::sin(theta + 0.5 * delta) * std::sin(0.5 * delta)) / cosine;
  };
  for (int k = 0; k < fan.n_elevation; ++k) {
    const double delta = fan.ray_angle_rad(k);
    const double offset_m = offset_at(delta);
    const double cosine = std::max(0.0, std::cos(theta + delta));
    offset_m_.push_back(offset_m);
    gamma_.push_back(double(appearance.brightness(static_cast<float>(cosine))));
    first_bin_.push_back(rays.bin_coordinate(offset_at(fan.ray_angle_rad(k - 0.5))));
    last_bin_.push_back(rays.bin_coordinate(offset_at(fan.ray_angle_rad(k + 0.5))));
  }
}

void GroundRays::deposit(int k, double along_track_m, double weight, std::span<double> bins) const {
  const auto n = static_cast<std::size_t>(k);
  if (!std::isfinite(offset_m_[n]) || !std::isfinite(first_bin_[n]) || !std::isfinite(last_bin_[n])) return;
  double mass = weight * gamma_[n];
  if (appearance_.checker) {
    mass *= double(appearance_.checker->factor(
        glm::vec3(rays_.scene_point(along_track_m, offset_m_[n], k))));
  }
  deposit_trapezoid(bins, first_bin_[n], last_bin_[n], 0.0, mass);
}

}  // namespace sarnerf
