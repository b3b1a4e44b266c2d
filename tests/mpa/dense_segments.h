// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "sarnerf/mpa/volume_march.h"

namespace sarnerf::test {

/// Cuts [near, far] (m) of a ray at the borders of bins, and evenly into parts no longer than `longest_m`, all along.
inline void append_segments(SampleBatch& batch, const RayGrid& grid, double along_track_m, int k,
                            const RangeInterval& interval, double longest_m = std::numeric_limits<double>::infinity()) {
  const Acquisition& a = grid.acquisition();
  const auto bin = [&](double s_m) { return s_m / a.range_spacing_m + 0.5 * a.n_range; };
  std::vector<double> near_bin;
  append_bins(batch, near_bin, grid, along_track_m, k, bin(interval.near_m), std::min(bin(interval.far_m), double(a.n_range)),
              {longest_m / a.range_spacing_m, 0.0});
}

}  // namespace sarnerf::test
