// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/level_ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sarnerf/core/bilinear.h"
#include "sarnerf/geometry/level_plane.h"

namespace sarnerf {

double LevelGround::texture_at(double x_m, double z_m) const {
  const double x = std::clamp((x_m - first_x_m) / cell_m, 0.0, texture.n_azimuth() - 1.0);
  const double z = std::clamp((z_m - first_z_m) / cell_m, 0.0, texture.n_range() - 1.0);
  return bilinear(texture, x, z);
}

double LevelGround::gain_at(double wanted_rad) const {
  const auto above = std::upper_bound(incidence_rad.begin(), incidence_rad.end(), wanted_rad) - incidence_rad.begin();
  if (above == 0) return gain.front();
  const auto n = static_cast<std::size_t>(above);
  if (n == gain.size()) return gain.back();
  const double part = (wanted_rad - incidence_rad[n - 1]) / (incidence_rad[n] - incidence_rad[n - 1]);
  return gain[n - 1] + part * (gain[n] - gain[n - 1]);
}

double LevelGround::mean_power() const {
  double sum = 0.0;
  for (const float t : texture.pixels()) sum += double{t};
  return sum * gain.front() / static_cast<double>(texture.pixels().size());
}

GroundBins ground_bins(const LevelGround& ground, const Acquisition& a, int row) {
  const RadarFrame frame = radar_frame(a);
  const glm::dvec3 away = level_range_direction(a);
  const double gain = ground.gain_at(a.incidence_rad), along_track_m = a.row_offset_m(row);
  GroundBins bins;
  for (const double offset_m : plane_offsets_m(a, ground.height_m)) {
    if (std::isnan(offset_m)) {
      bins.angle_rad.push_back(std::numeric_limits<double>::quiet_NaN());
      bins.power.push_back(0.0f);
      continue;
    }
    const glm::dvec3 point_m = along_track_m * frame.h + offset_m * away + glm::dvec3(0.0, ground.height_m, 0.0);
    bins.angle_rad.push_back(project(a, frame, point_m).ray_angle_rad);
    bins.power.push_back(static_cast<float>(gain * ground.texture_at(point_m.x, point_m.z)));
  }
  return bins;
}

}  // namespace sarnerf
