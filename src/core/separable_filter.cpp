// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/separable_filter.h"

#include <algorithm>

#include "sarnerf/core/clones.h"

namespace sarnerf {
namespace {

SARNERF_CLONES void add_scaled(std::size_t n, double factor, const double* from, double* to) {
  for (std::size_t k = 0; k < n; ++k) to[k] += factor * from[k];
}

SARNERF_CLONES void add_scaled_row(std::size_t n, double factor, const float* from, double* to) {
  for (std::size_t k = 0; k < n; ++k) to[k] += factor * double(from[k]);
}

}  // namespace

void spread(double value, std::span<const double> taps, int j, std::span<double> row) {
  const int reach = static_cast<int>(taps.size() / 2);
  const int first = std::max(0, j - reach), end = std::min(static_cast<int>(row.size()), j + reach + 1);
  add_scaled(static_cast<std::size_t>(end - first), value, taps.data() + (first - j + reach),
             row.data() + first);
}

void gather_rows(const Plane& plane, std::span<const double> taps, int i, std::span<double> sum) {
  const int reach = static_cast<int>(taps.size() / 2);
  std::fill(sum.begin(), sum.end(), 0.0);
  const int last = std::min(plane.values.n_azimuth() - 1, i + reach);
  for (int from = std::max(0, i - reach); from <= last; ++from) {
    if (!plane.row_used[static_cast<std::size_t>(from)]) continue;
    add_scaled_row(sum.size(), taps[static_cast<std::size_t>(i - from + reach)],
                   plane.values.row(from).data(), sum.data());
  }
}

}  // namespace sarnerf
