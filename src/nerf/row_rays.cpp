// SPDX-License-Identifier: Apache-2.0
#include "row_rays.h"

#include <algorithm>
#include <cmath>

namespace sarnerf {
namespace {

constexpr double kGoldenRatio = 0.6180339887498949;

double fractional(double x) { return x - std::floor(x); }

struct Comb {
  Fan fan;
  double first;  ///< number of the first ray, counted from the aim point
};

Comb comb_over(const RowRequest& request, const Box& box_m, double spacing_m) {
  const auto extent = angular_extent(request.acquisition, box_m);
  const double low = std::max(extent.first, request.least_angle_rad);
  const double high = std::min(extent.second, request.most_angle_rad);
  const double step = spacing_m / request.acquisition.slant_range_m, jitter = request.fan_jitter;
  // Ray n has the angle (n + jitter) step; the fan begins half a step before its first ray.
  const double first = std::ceil(low / step - jitter), last = std::floor(high / step - jitter);
  return {{(first + jitter - 0.5) * step, step, std::max(0, static_cast<int>(last - first) + 1)},
          first};
}

}  // namespace

RowRays rays_of_row(const RowRequest& request, const Box& box_m, const RaySampling& sampling) {
  const Acquisition& a = request.acquisition;
  if (box_m.empty()) return {RayGrid(a, {}), {}};
  const Comb comb = comb_over(request, box_m, sampling.ray_spacing_m);
  RowRays row{RayGrid(a, comb.fan), {}};
  for (int m = 0; m < sampling.sub_rows; ++m) {
    for (int k = 0; k < comb.fan.n_elevation; ++k) {
      const double place = fractional(request.along_track_jitter + kGoldenRatio * (comb.first + k));
      const double offset = (m + place) / sampling.sub_rows - 0.5;
      const double along_track_m = a.row_offset_m(request.row + offset);
      const RangeInterval inside = clip_to_box(row.grid, along_track_m, k, box_m);
      if (!inside.empty()) row.rays.push_back({along_track_m, 0, k, inside});
    }
  }
  return row;
}

std::size_t n_pixels(std::span<const RowRequest> rows) {
  std::size_t n = 0;
  for (const RowRequest& r : rows) n += static_cast<std::size_t>(r.acquisition.n_range);
  return n;
}

}  // namespace sarnerf
