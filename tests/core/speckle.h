// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <complex>
#include <random>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf::test {

/// Fully developed speckle of mean 1: the mean of |h ⊛ w|² over `looks` fields w of white complex Gaussian noise. With a
/// kernel h of exp(−d²/2σ²) two pixels d apart correlate in power by exp(−d²/2σ²), too; without one (σ = 0) not at all,
/// and each is a gamma variable.
inline Image<float> speckle(int n, int looks, double correlation_pixels, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const int reach = static_cast<int>(std::ceil(4.0 * correlation_pixels)), wide = n + 2 * reach;
  std::vector<double> kernel;
  double energy = 0.0;
  for (int d = -reach; d <= reach; ++d) {
    kernel.push_back(reach == 0 ? 1.0
                                : std::exp(-0.5 * d * d / (correlation_pixels * correlation_pixels)));
    energy += kernel.back() * kernel.back();
  }
  Image<float> power(n, n);
  for (int look = 0; look < looks; ++look) {
    Image<std::complex<double>> field(wide, wide), along(wide, n);
    for (auto& w : field.pixels()) w = {normal(random), normal(random)};
    for (int i = 0; i < wide; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = 0; k <= 2 * reach; ++k)
          along(i, j) += kernel[static_cast<std::size_t>(k)] * field(i, j + k);
      }
    }
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        std::complex<double> sum;
        for (int k = 0; k <= 2 * reach; ++k)
          sum += kernel[static_cast<std::size_t>(k)] * along(i + k, j);
        power(i, j) += static_cast<float>(std::norm(sum) / (2.0 * looks * energy * energy));
      }
    }
  }
  return power;
}

}  // namespace sarnerf::test
