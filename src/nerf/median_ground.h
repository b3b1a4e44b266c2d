// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/background.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// Median, reordering the values; 0 of none.
inline double median(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Row and bin of the pixel that shows a point; nothing where the image does not hold it.
inline std::optional<glm::ivec2> pixel_of(const Acquisition& a, const RadarPoint& p) {
  const auto i = static_cast<int>(std::lround(p.along_track_m / a.azimuth_spacing_m + 0.5 * (a.n_azimuth - 1)));
  const auto j = static_cast<int>(std::lround(p.range_offset_m / a.range_spacing_m + 0.5 * (a.n_range - 1)));
  if (i < 0 || i >= a.n_azimuth || j < 0 || j >= a.n_range) return {};
  return glm::ivec2(i, j);
}

/// A first look at the level ground that images show around what stands on it.
struct MedianGround {
  double height_m = 0.0;             ///< of the plane, relative to the aim point
  double cell_m = 0.0;               ///< of the texture
  double first_x_m = 0.0, first_z_m = 0.0;  ///< centre of texture(0, 0)
  Image<float> texture;              ///< [x, z] brightness of the ground, of the views' median; 0 where no view sees it
  std::vector<double> gain;          ///< of each view: β⁰ there is gain × texture
  double deviation = 0.0;            ///< relative deviation of pixels from gain × texture, robust (1.48 × median)
};

/// The ground at the bottom of the box; images and box relative to the aim point. Its texture is the median of up to 48
/// views, turned onto the plane; views' gains and texture follow from one another. Nothing where images have no background,
/// or are too few to tell ground from what stands on it (fewer than 6).
///
/// Cost: views × cells and views × pixels, some 50 ns each, in parallel.
std::optional<MedianGround> median_ground(std::span<const PosedImage> images, const Box& box_m);

}  // namespace sarnerf
