// SPDX-License-Identifier: Apache-2.0
#include "gaussian.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

std::vector<float> half_kernel(double sigma) {
  std::vector<float> kernel;
  for (int n = 0; n <= static_cast<int>(std::ceil(3.0 * sigma)); ++n)
    kernel.push_back(static_cast<float>(std::exp(-0.5 * n * n / (sigma * sigma))));
  return kernel;
}

/// Along rows, and the result turned: twice makes both directions.
Image<float> along_rows_turned(const Image<float>& image, const std::vector<float>& kernel) {
  const int rows = image.n_azimuth(), columns = image.n_range(), reach = static_cast<int>(kernel.size()) - 1;
  Image<float> turned(columns, rows);
  parallel_for(static_cast<std::size_t>(rows), 8, [&](std::size_t begin, std::size_t end, int) {
    for (auto i = static_cast<int>(begin); i < static_cast<int>(end); ++i)
      for (int j = 0; j < columns; ++j) {
        float sum = 0.0f;
        for (int n = std::max(0, j - reach); n <= std::min(columns - 1, j + reach); ++n)
          sum += kernel[static_cast<std::size_t>(std::abs(n - j))] * image(i, n);
        turned(j, i) = sum;
      }
  });
  return turned;
}

}  // namespace

Image<float> weighted_gaussian(const Image<float>& image, const Image<float>& weight, double sigma, double otherwise) {
  constexpr float kLeastWeight = 1e-6f;
  const std::vector<float> kernel = half_kernel(sigma);
  Image<float> weighted = image;
  for (std::size_t n = 0; n < weighted.pixels().size(); ++n) weighted.pixels()[n] *= weight.pixels()[n];
  weighted = along_rows_turned(along_rows_turned(weighted, kernel), kernel);
  const Image<float> sum = along_rows_turned(along_rows_turned(weight, kernel), kernel);
  for (std::size_t n = 0; n < weighted.pixels().size(); ++n) {
    const float s = sum.pixels()[n];
    weighted.pixels()[n] = s > kLeastWeight ? weighted.pixels()[n] / s : static_cast<float>(otherwise);
  }
  return weighted;
}

}  // namespace sarnerf
