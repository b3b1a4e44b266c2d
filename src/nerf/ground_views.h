// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/bare_ground.h"

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

/// The ground at the bottom of the box as the median of the views has it, with gains and deviation, no pixel being bare
/// yet; nothing where images are too few or have no background.
std::optional<BareGround> estimated_ground(std::span<const PosedImage> images, const Box& box_m);

}  // namespace sarnerf
