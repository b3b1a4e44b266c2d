// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <utility>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/sample_batch.h"

namespace sarnerf {

/// Part of a ray, as range offsets s = t − r (m).
struct RangeInterval {
  double near_m = 0.0;
  double far_m = 0.0;
  bool empty() const { return !(near_m < far_m); }
};

/// The part of ray (row a, elevation k) inside a box given relative to the aim point.
RangeInterval clip_to_box(const RayGrid& grid, double along_track_m, int k,
                          const Box& box_from_aim);

/// Opens a ray in the batch; segments appended until the next call belong to it.
void begin_ray(SampleBatch& batch, const RayGrid& grid, int row, int k);

/// Cuts [near, far] at the borders of the range bins, and the parts evenly until none is longer than
/// `longest_m`, and appends a segment for each part, with its centre point. Parts nearer than bin 0 get kNoBin, cut at the
/// same pitch; parts beyond the last bin are left out, since nothing behind them is seen. This is the dense form, for tests and
/// comparisons: engines and training march through what is occupied (volume_march.h).
void append_segments(SampleBatch& batch, const RayGrid& grid, double along_track_m, int k,
                     const RangeInterval& interval,
                     double longest_m = std::numeric_limits<double>::infinity());

}  // namespace sarnerf
