// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// The fan of ray angles δ_k = δ_0 + (k + ½) Δθ, measured from k towards +v. In general it is not symmetric.
struct Fan {
  double first_angle_rad = 0.0;  ///< δ_0, the fan's border, not its first ray
  double step_rad = 0.0;         ///< Δθ
  int n_elevation = 0;

  double ray_angle_rad(double k) const { return first_angle_rad + (k + 0.5) * step_rad; }
  double last_angle_rad() const { return first_angle_rad + n_elevation * step_rad; }
};

/// Smallest and largest ray angle (rad) of the box, from its corners.
std::pair<double, double> angular_extent(const Acquisition& acquisition, const Box& box);

/// Angles (rad) under which the radar sees the plane y = ground_height at the near border of bin 0 (at the nadir
/// if that border is nearer than the plane) and at the far border of the last bin. Empty if no bin reaches the
/// plane (all are nearer than the radar's height), or if the radar is not above it. The plane's ray angle is δ
/// with cos(θ + δ) = H / range.
std::optional<std::pair<double, double>> ground_angular_extent(const Acquisition& acquisition,
                                                               double ground_height_m);

/// The fan of n_elevation rays over [first, last] (rad). Throws GeometryError for no rays or an angle that is not positive.
Fan make_fan(std::pair<double, double> extent_rad, int n_elevation);

/// Rays of one acquisition in origin-centred form (docs/method/equations.md, E4):
///
///     point(i, t, k) = aim + a_i h + s d_k + e_k,   s = t − r,   e_k = r (d_k − k)
///
/// with e_k computed from half-angles, so that no number of the size of the slant range is ever added.
class RayGrid {
 public:
  RayGrid(const Acquisition& acquisition, const Fan& fan);

  const Acquisition& acquisition() const { return acquisition_; }
  const Fan& fan() const { return fan_; }
  const RadarFrame& frame() const { return frame_; }

  const glm::dvec3& direction(int k) const { return direction_[static_cast<std::size_t>(k)]; }
  const glm::dvec3& offset_m(int k) const { return offset_m_[static_cast<std::size_t>(k)]; }

  /// Point relative to the aim point (m) at along-track coordinate a and range offset s = t − r.
  glm::dvec3 point_from_aim_m(double a_m, double s_m, int k) const {
    return a_m * frame_.h + s_m * direction(k) + offset_m(k);
  }

 private:
  Acquisition acquisition_;
  Fan fan_;
  RadarFrame frame_;
  std::vector<glm::dvec3> direction_;
  std::vector<glm::dvec3> offset_m_;
};

}  // namespace sarnerf
