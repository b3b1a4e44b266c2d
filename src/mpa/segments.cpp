// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/segments.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {

RangeInterval clip_to_box(const RayGrid& grid, double along_track_m, int k,
                          const Box& box_from_aim) {
  if (box_from_aim.empty()) return {};
  const glm::dvec3 start = grid.point_from_aim_m(along_track_m, 0.0, k);
  const glm::dvec3 d = grid.direction(k);
  // Nothing behind the radar is seen.
  RangeInterval inside{-grid.acquisition().slant_range_m, std::numeric_limits<double>::infinity()};
  for (int axis = 0; axis < 3; ++axis) {
    const double to_min = box_from_aim.min[axis] - start[axis];
    const double to_max = box_from_aim.max[axis] - start[axis];
    if (d[axis] == 0.0) {
      // Parallel to these faces: 0/0 if it lies in one of them, so the quotients below say nothing.
      if (to_min > 0.0 || to_max < 0.0) return {};
      continue;
    }
    const double at_min = to_min / d[axis];
    const double at_max = to_max / d[axis];
    inside.near_m = std::max(inside.near_m, std::min(at_min, at_max));
    inside.far_m = std::min(inside.far_m, std::max(at_min, at_max));
  }
  return inside.empty() ? RangeInterval{} : inside;
}

void begin_ray(SampleBatch& batch, const RayGrid& grid, int row, int k) {
  batch.ray_row.push_back(static_cast<std::uint32_t>(row));
  batch.ray_elevation.push_back(static_cast<std::uint32_t>(k));
  batch.ray_direction.emplace_back(grid.direction(k));
  batch.ray_begin.push_back(static_cast<std::uint32_t>(batch.n_segments()));
}

void append_segments(SampleBatch& batch, const RayGrid& grid, double along_track_m, int k,
                     const RangeInterval& interval, double longest_m) {
  const Acquisition& a = grid.acquisition();
  const double spacing_m = a.range_spacing_m;
  // Bin j covers [border_m(j), border_m(j + 1)).
  const auto border_m = [&](double j) { return (j - 0.5 * a.n_range) * spacing_m; };
  const double far_m = std::min(interval.far_m, border_m(a.n_range));
  if (!(interval.near_m < far_m)) return;

  // Rounding may put a near end that lies on a border to either side of it.
  const double first =
      std::min(std::floor(interval.near_m / spacing_m + 0.5 * a.n_range), a.n_range - 1.0);
  const double last = std::floor(far_m / spacing_m + 0.5 * a.n_range);
  const double n_extra = (far_m - interval.near_m) / longest_m;
  if (!(static_cast<double>(batch.n_segments()) + (last - first) + n_extra + 1.0 <
        static_cast<double>(std::numeric_limits<std::uint32_t>::max()))) {
    throw UsageError("a batch of rays holds at most 4294967295 segments; give it fewer rays");
  }
  double near_m = interval.near_m;
  for (double j = first; near_m < far_m; j += 1.0) {
    const double end_m = std::min(border_m(j + 1.0), far_m);
    if (!(near_m < end_m)) continue;
    const double n_parts = std::max(1.0, std::ceil((end_m - near_m) / longest_m));
    const double part_m = (end_m - near_m) / n_parts;
    for (double n = 0.0; n < n_parts; n += 1.0) {
      batch.bin.push_back(j < 0.0 ? kNoBin : static_cast<std::uint32_t>(j));
      batch.length_m.push_back(static_cast<float>(part_m));
      batch.point_m.emplace_back(
          grid.point_from_aim_m(along_track_m, near_m + (n + 0.5) * part_m, k));
    }
    near_m = end_m;
  }
  batch.ray_begin.back() = static_cast<std::uint32_t>(batch.n_segments());
}

}  // namespace sarnerf
