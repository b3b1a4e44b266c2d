// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// A plane of intermediate values: rows that hold nothing but zeros are known, and skipped.
struct Plane {
  Plane(int n_azimuth, int n_range)
      : values(n_azimuth, n_range), row_used(static_cast<std::size_t>(n_azimuth), 0) {}
  Image<float> values;
  std::vector<char> row_used;
};

/// Adds value × taps, centred on element j, to a row; taps that stick out of it are dropped.
void spread(double value, std::span<const double> taps, int j, std::span<double> row);

/// sum = Σ_n taps_n × row (i − n) of the plane: one row of its convolution along azimuth. The sums are in
/// double and in order of rows.
void gather_rows(const Plane& plane, std::span<const double> taps, int i, std::span<double> sum);

}  // namespace sarnerf
