// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/geometry/level_plane.h"

#include <cmath>
#include <limits>

namespace sarnerf {

std::vector<double> plane_offsets_m(const Acquisition& a, double height_m) {
  // With g the distance along the plane, the difference of g and r sin θ is formed from g² − r² sin² θ, which keeps
  // large numbers from cancelling.
  const double r = a.slant_range_m, aim = r * std::sin(a.incidence_rad);
  const double lift = height_m * (2.0 * a.altitude_m() - height_m);
  std::vector<double> offsets;
  for (int j = 0; j < a.n_range; ++j) {
    const double s = a.bin_offset_m(j);
    const double farther = s * (2.0 * r + s) + lift;  // g² − r² sin² θ
    const double g2 = aim * aim + farther;
    offsets.push_back(g2 >= 0.0 ? farther / (std::sqrt(g2) + aim) : std::numeric_limits<double>::quiet_NaN());
  }
  return offsets;
}

glm::dvec3 level_range_direction(const Acquisition& a) {
  return {-std::sin(a.azimuth_rad), 0.0, -std::cos(a.azimuth_rad)};
}

}  // namespace sarnerf
