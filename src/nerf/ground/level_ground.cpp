// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/nerf/ground.h"

namespace sarnerf {

double LevelGround::texture_at(double x_m, double z_m) const {
  const double x = std::clamp((x_m - first_x_m) / cell_m, 0.0, texture.n_azimuth() - 1.0);
  const double z = std::clamp((z_m - first_z_m) / cell_m, 0.0, texture.n_range() - 1.0);
  return bilinear(texture, x, z);
}

double LevelGround::gain_at(double wanted_rad) const {
  const auto above = static_cast<std::size_t>(std::ranges::upper_bound(incidence_rad, wanted_rad) - incidence_rad.begin());
  const std::size_t before = above > 0 ? above - 1 : 0, after = std::min(above, gain.size() - 1);
  // Times tan θ / tan θ of the pitch: exactly the gain of a pitch at its incidence.
  const auto of = [&](std::size_t pitch) { return gain[pitch] * (std::tan(incidence_rad[pitch]) / std::tan(wanted_rad)); };
  if (before == after) return of(before);
  const double part = (wanted_rad - incidence_rad[before]) / (incidence_rad[after] - incidence_rad[before]);
  return of(before) + part * (of(after) - of(before));
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
  bins.noise = ground.noise;
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

Image<float> ground_image(const LevelGround& ground, const Acquisition& a) {
  Image<float> image(a.n_azimuth, a.n_range);
  for (int i = 0; i < a.n_azimuth; ++i) {
    const GroundBins bins = ground_bins(ground, a, i);
    std::copy(bins.power.begin(), bins.power.end(), image.row(i).begin());
  }
  return image;
}

namespace {

/// Margin on either side of the window, for rounding and for interpolation between voxels.
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

LayoverShadowWindow layover_shadow_window(const Acquisition& a, const Box& object_m, double ground_height_m) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (object_m.empty()) return {-kInfinity, kInfinity, 0, 0};
  const RadarFrame frame = radar_frame(a);
  double nearest_m = kInfinity;
  for (const glm::dvec3& corner : object_m.corners())
    nearest_m = std::min(nearest_m, project(a, frame, corner).range_offset_m);
  const std::vector<double> angle = plane_angles(a, ground_height_m);
  const double last_angle = angular_extent(a, object_m).second;
  const auto shadow_end = static_cast<int>(std::upper_bound(angle.begin(), angle.end(), last_angle) - angle.begin());

  const auto nearest_bin = static_cast<int>(std::floor(std::clamp(a.bin_of(nearest_m), 0.0, double(a.n_range))));
  LayoverShadowWindow window{-kInfinity, kInfinity, std::max(0, nearest_bin - kMargin_bins),
                    std::min(a.n_range, shadow_end + kMargin_bins)};
  if (window.first_bin >= kMargin_bins)
    window.least_angle_rad = angle[static_cast<std::size_t>(window.first_bin - kMargin_bins)];
  if (window.end_bin + kMargin_bins < a.n_range)
    window.most_angle_rad = angle[static_cast<std::size_t>(window.end_bin + kMargin_bins)];
  return window;
}

}  // namespace sarnerf
