// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/convolve_power.h"

#include <algorithm>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/core/separable_filter.h"

namespace sarnerf {
namespace {

constexpr std::size_t kRowsAtOnce = 4;

/// The response of mean power: |h_n|².
std::vector<double> power_taps(const Kernel& kernel) {
  std::vector<double> taps = kernel.taps;
  for (double& tap : taps) tap *= tap;
  return taps;
}

}  // namespace

void convolve_power(Image<float>& power, const ImpulseResponse& response, const Monitor& monitor) {
  const std::vector<double> along_range = power_taps(response.range);
  const std::vector<double> along_azimuth = power_taps(response.azimuth);
  const auto n_azimuth = static_cast<std::size_t>(power.n_azimuth());
  const auto width = static_cast<std::size_t>(power.n_range());
  Plane plane(power.n_azimuth(), power.n_range());
  parallel_for(n_azimuth, kRowsAtOnce, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    std::vector<double> row(width);
    for (std::size_t n = begin; n < end; ++n) {
      const int i = static_cast<int>(n);
      std::fill(row.begin(), row.end(), 0.0);
      for (int j = 0; j < power.n_range(); ++j) {
        if (power(i, j) == 0.0f) continue;
        plane.row_used[n] = 1;
        spread(double{power(i, j)}, along_range, j, row);
      }
      for (std::size_t j = 0; j < width; ++j) plane.values.row(i)[j] = static_cast<float>(row[j]);
    }
  });
  parallel_for(n_azimuth, kRowsAtOnce, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    std::vector<double> row(width);
    for (std::size_t n = begin; n < end; ++n) {
      const int i = static_cast<int>(n);
      gather_rows(plane, along_azimuth, i, row);
      for (std::size_t j = 0; j < width; ++j) power.row(i)[j] = static_cast<float>(row[j]);
    }
  });
}

}  // namespace sarnerf
