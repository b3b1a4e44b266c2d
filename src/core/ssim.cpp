// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/ssim.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gaussian_weights.h"
#include "same_size.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr int kWindow = 11;
constexpr double kSigma_pixels = 1.5;

/// What a window sees of the image x and the reference y: weighted means of x, y, x², y², xy.
struct Moments {
  double x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;

  void add(double weight, const Moments& m) {
    x += weight * m.x;
    y += weight * m.y;
    xx += weight * m.xx;
    yy += weight * m.yy;
    xy += weight * m.xy;
  }
};

Moments of_pixel(double x, double y) { return {x, y, x * x, y * y, x * y}; }

/// Weights along a side of n pixels.
std::vector<double> window_weights(int n) {
  return gaussian_weights(static_cast<std::size_t>(std::min(n, kWindow)), kSigma_pixels);
}

double similarity(const Moments& m, double c1, double c2) {
  const double xx = m.xx - m.x * m.x, yy = m.yy - m.y * m.y, xy = m.xy - m.x * m.y;
  return (2.0 * m.x * m.y + c1) * (2.0 * xy + c2) / ((m.x * m.x + m.y * m.y + c1) * (xx + yy + c2));
}

}  // namespace

double ssim(const Image<float>& image, const Image<float>& reference, double peak) {
  require_same_size(image, reference);
  if (image.pixels().empty()) throw UsageError("images without pixels have no similarity");
  if (!(peak > 0.0 && std::isfinite(peak))) {
    throw UsageError("the peak of an SSIM must be positive and finite; it is " +
                     std::to_string(peak));
  }
  const double c1 = 0.01 * peak * (0.01 * peak), c2 = 0.03 * peak * (0.03 * peak);
  const std::vector<double> down = window_weights(image.n_azimuth()),
                            along = window_weights(image.n_range());
  const int n_i = image.n_azimuth() - static_cast<int>(down.size()) + 1;
  const int n_j = image.n_range() - static_cast<int>(along.size()) + 1;

  double sum = 0.0;
  std::vector<Moments> columns(static_cast<std::size_t>(image.n_range()));
  for (int i = 0; i < n_i; ++i) {
    std::fill(columns.begin(), columns.end(), Moments{});
    for (std::size_t m = 0; m < down.size(); ++m) {
      const auto x = image.row(i + static_cast<int>(m)), y = reference.row(i + static_cast<int>(m));
      for (std::size_t j = 0; j < columns.size(); ++j)
        columns[j].add(down[m], of_pixel(x[j], y[j]));
    }
    for (std::size_t j = 0; j < static_cast<std::size_t>(n_j); ++j) {
      Moments window;
      for (std::size_t m = 0; m < along.size(); ++m) window.add(along[m], columns[j + m]);
      sum += similarity(window, c1, c2);
    }
  }
  return sum / (double(n_i) * double(n_j));
}

}  // namespace sarnerf
