// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/gaussian_blur.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "gaussian_weights.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Blurs n pixels that lie `stride` apart.
void blur_line(const float* from, float* to, int n, std::ptrdiff_t stride,
               const std::vector<double>& weights) {
  const int reach = static_cast<int>(weights.size() / 2);
  for (int m = 0; m < n; ++m) {
    double sum = 0.0, weight = 0.0;
    for (int k = std::max(0, m - reach); k <= std::min(n - 1, m + reach); ++k) {
      const double w = weights[static_cast<std::size_t>(k - m + reach)];
      sum += w * double(from[stride * k]);
      weight += w;
    }
    to[stride * m] = static_cast<float>(sum / weight);
  }
}

}  // namespace

std::vector<double> gaussian_weights(std::size_t n, double sigma_pixels) {
  std::vector<double> weights(n);
  const double centre = 0.5 * (double(n) - 1.0);
  double sum = 0.0;
  for (std::size_t m = 0; m < n; ++m) {
    const double d = (double(m) - centre) / sigma_pixels;
    sum += weights[m] = std::exp(-0.5 * d * d);
  }
  for (double& w : weights) w /= sum;
  return weights;
}

Image<float> gaussian_blur(const Image<float>& image, double sigma_pixels) {
  if (!(sigma_pixels >= 0.0 && std::isfinite(sigma_pixels))) {
    throw UsageError("an image is blurred by a finite number of pixels, 0 or more; asked for " +
                     std::to_string(sigma_pixels));
  }
  if (sigma_pixels == 0.0 || image.pixels().empty()) return image;
  // No line reaches further than the image is long.
  const double longest = std::max(image.n_azimuth(), image.n_range());
  const auto reach = static_cast<std::size_t>(std::min(std::ceil(3.0 * sigma_pixels), longest));
  const std::vector<double> weights = gaussian_weights(2 * reach + 1, sigma_pixels);

  Image<float> along(image.n_azimuth(), image.n_range()), blurred = along;
  for (int i = 0; i < image.n_azimuth(); ++i)
    blur_line(&image(i, 0), &along(i, 0), image.n_range(), 1, weights);
  for (int j = 0; j < image.n_range(); ++j)
    blur_line(&along(0, j), &blurred(0, j), image.n_azimuth(), image.n_range(), weights);
  return blurred;
}

}  // namespace sarnerf
