// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "sarnerf/core/bilinear.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/level_plane.h"
#include "sarnerf/nerf/bare_ground.h"

namespace sarnerf {

/// Median, reordering the values; 0 of none.
inline double median(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Value of a view at a point of the plane; negative outside of its swath, which goes on for a pixel here, so that cells
/// around its outermost pixels have values.
inline double seen(const PosedImage& image, const RadarFrame& frame, const glm::dvec3& point_m) {
  const Acquisition& a = image.acquisition;
  const RadarPoint p = project(a, frame, point_m);
  const double i = p.along_track_m / a.azimuth_spacing_m + 0.5 * (a.n_azimuth - 1);
  const double j = p.range_offset_m / a.range_spacing_m + 0.5 * (a.n_range - 1);
  if (i < -1.0 || i > a.n_azimuth || j < -1.0 || j > a.n_range) return -1.0;
  return bilinear(image.power, std::clamp(i, 0.0, a.n_azimuth - 1.0), std::clamp(j, 0.0, a.n_range - 1.0));
}

/// Calls visit(i, j, x, z) for the pixels of a view that see the plane, in cells of the texture.
template <class Visit>
void for_each_pixel(const Acquisition& a, const BareGround& ground, Visit&& visit) {
  const std::vector<double> offset_m = plane_offsets_m(a, ground.height_m);
  const glm::dvec3 along_track = radar_frame(a).h, away = level_range_direction(a);
  for (int i = 0; i < a.n_azimuth; ++i) {
    for (int j = 0; j < a.n_range; ++j) {
      const double d = offset_m[static_cast<std::size_t>(j)];
      if (std::isnan(d)) continue;
      const glm::dvec3 p = a.row_offset_m(i) * along_track + d * away;
      visit(i, j, (p.x - ground.first_x_m) / ground.cell_m, (p.z - ground.first_z_m) / ground.cell_m);
    }
  }
}

/// Views spread evenly over a set: enough for a texture.
std::vector<std::size_t> views_of_texture(std::size_t n);

/// The ground at the bottom of the box as the median of the views has it, with gains and deviation, no pixel being bare
/// yet; nothing where images are too few or have no background.
std::optional<BareGround> estimated_ground(std::span<const PosedImage> images, const Box& box_m);

}  // namespace sarnerf
