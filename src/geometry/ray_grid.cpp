// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/geometry/ray_grid.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/error.h"

namespace sarnerf {

std::pair<double, double> angular_extent(const Acquisition& acquisition, const Box& box) {
  const RadarFrame frame = radar_frame(acquisition);
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  for (const glm::dvec3& corner : box.corners()) {
    const double angle = project(acquisition, frame, corner).ray_angle_rad;
    first = std::min(first, angle);
    last = std::max(last, angle);
  }
  return {first, last};
}

std::optional<std::pair<double, double>> ground_angular_extent(const Acquisition& a,
                                                               double ground_height_m) {
  const double height = a.altitude_m() + (a.aim_m.y - ground_height_m);
  const double near_m = a.range_m(-0.5), far_m = a.range_m(a.n_range - 0.5);
  if (height <= 0.0 || far_m <= height) return std::nullopt;
  const auto angle = [&](double range_m) {
    return std::acos(std::min(1.0, height / range_m)) - a.incidence_rad;
  };
  return std::pair{angle(std::max(near_m, height)), angle(far_m)};
}

Fan make_fan(std::pair<double, double> extent_rad, int n_elevation) {
  if (n_elevation < 1 || !(extent_rad.first < extent_rad.second)) {
    throw GeometryError("a fan of rays needs a positive angle and at least one ray");
  }
  return {extent_rad.first, (extent_rad.second - extent_rad.first) / n_elevation, n_elevation};
}

RayGrid::RayGrid(const Acquisition& acquisition, const Fan& fan)
    : acquisition_(acquisition), fan_(fan), frame_(radar_frame(acquisition)) {
  const auto n = static_cast<std::size_t>(fan.n_elevation);
  direction_.reserve(n);
  offset_m_.reserve(n);
  for (int k = 0; k < fan.n_elevation; ++k) {
    const double angle = fan.ray_angle_rad(k);
    const double half_sine = std::sin(0.5 * angle);
    const double sine = std::sin(angle);
    const glm::dvec3 d_minus_k = -2.0 * half_sine * half_sine * frame_.k + sine * frame_.v;
    direction_.push_back(frame_.k + d_minus_k);
    offset_m_.push_back(acquisition.slant_range_m * d_minus_k);
  }
}

}  // namespace sarnerf
