// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "slice_line.h"

namespace sarnerf {

/// What turns points of a slice's plane into ranges and world points. Doubles throughout.
struct SliceFrame {
  explicit SliceFrame(const Acquisition& view)
      : radar(radar_frame(view)),
        aim_m(view.aim_m),
        r(view.slant_range_m),
        bins_per_m(1.0 / view.range_spacing_m),
        first_bin(0.5 * view.n_range) {}

  /// Range in bin coordinates (bin j covers [j, j + 1)) of the point at a depth along a ray. The aim point's
  /// range is never subtracted from another one.
  double bin_at(double tangent, double depth_m) const {
    const double across_m = (r + depth_m) * tangent, range_m = std::hypot(r + depth_m, across_m);
    const double offset_m = (depth_m * (2.0 * r + depth_m) + across_m * across_m) / (range_m + r);
    return offset_m * bins_per_m + first_bin;
  }
  double bin_at(const SliceLine& line, double tangent) const { return bin_at(tangent, line.depth_at(tangent, r)); }

  glm::dvec3 world_m(double along_m, const SliceLine& line, double tangent) const {
    const double depth_m = line.depth_at(tangent, r);
    return aim_m + (along_m * radar.h + (r + depth_m) * tangent * radar.v + depth_m * radar.k);
  }

  /// Angle (rad) between two rays, exact for close ones.
  static double angle_between(double first, double last) { return std::atan((last - first) / (1.0 + first * last)); }

  RadarFrame radar;
  glm::dvec3 aim_m;
  double r;  ///< slant range of the aim point (m)
  double bins_per_m, first_bin;
};

}  // namespace sarnerf
