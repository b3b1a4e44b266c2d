// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/metrics.h"

#include <cmath>
#include <random>
#include <vector>

#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

namespace {

Image<float> noise(int n_azimuth, int n_range, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<float> power(2.0f);
  Image<float> image(n_azimuth, n_range);
  for (float& p : image.pixels()) p = power(random);
  return image;
}

/// The definition, one window at a time: two-dimensional weights, centred moments, nothing separable.
double by_definition(const Image<float>& x, const Image<float>& y, double peak) {
  const int wi = std::min(11, x.n_azimuth()), wj = std::min(11, x.n_range());
  double total = 0.0;
  int count = 0;
  for (int i = 0; i + wi <= x.n_azimuth(); ++i) {
    for (int j = 0; j + wj <= x.n_range(); ++j) {
      const auto mean = [&](auto&& value) {
        double sum = 0.0, weights = 0.0;
        for (int a = 0; a < wi; ++a) {
          for (int b = 0; b < wj; ++b) {
            const double da = a - (wi - 1) / 2.0, db = b - (wj - 1) / 2.0;
            const double w = std::exp(-(da * da + db * db) / (2 * 1.5 * 1.5));
            weights += w;
            sum += w * value(x(i + a, j + b), y(i + a, j + b));
          }
        }
        return sum / weights;
      };
      const double mx = mean([](double p, double) { return p; });
      const double my = mean([](double, double q) { return q; });
      const double vx = mean([&](double p, double) { return (p - mx) * (p - mx); });
      const double vy = mean([&](double, double q) { return (q - my) * (q - my); });
      const double cov = mean([&](double p, double q) { return (p - mx) * (q - my); });
      const double c1 = 1e-4 * peak * peak, c2 = 9e-4 * peak * peak;
      total += (2 * mx * my + c1) * (2 * cov + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2));
      ++count;
    }
  }
  return total / count;
}

}  // namespace

TEST_CASE("SSIM is the mean over the windows inside the image, by the definition") {
  // One window; several; sides shorter than the window, even and odd; a single pixel.
  const int sizes[][2] = {{11, 11}, {17, 23}, {5, 30}, {13, 4}, {3, 2}, {1, 1}};
  for (const auto& [n_azimuth, n_range] : sizes) {
    CAPTURE(n_azimuth, n_range);
    const Image<float> y = noise(n_azimuth, n_range, 1);
    Image<float> x = noise(n_azimuth, n_range, 2);
    for (std::size_t n = 0; n < x.pixels().size(); ++n) {
      x.pixels()[n] = 0.3f * x.pixels()[n] + 0.7f * y.pixels()[n];
    }
    for (const double peak : {0.5, 3.0}) {
      const double found = ssim(x, y, peak);
      CHECK(found == Approx(by_definition(x, y, peak)).epsilon(1e-10));
      CHECK(ssim(y, x, peak) == Approx(found).epsilon(1e-12));
      CHECK(found < 1.0);
    }
  }
}

TEST_CASE("SSIM: closed forms of flat images, and one for equal ones") {
  const Image<float> y = noise(20, 20, 3);
  CHECK(ssim(y, y, 1.0) == Approx(1.0).epsilon(1e-14));
  const Image<float> half(15, 15, 0.5f), one(15, 15, 1.0f);
  CHECK(ssim(half, one, 1.0) == Approx((2 * 0.5 + 1e-4) / (0.25 + 1 + 1e-4)).epsilon(1e-9));
  CHECK(ssim(Image<float>(12, 12), Image<float>(12, 12), 1.0) == 1.0);
}

TEST_CASE("SSIM does not change with the unit") {
  const Image<float> x = noise(16, 19, 4), y = noise(16, 19, 5);
  Image<float> x8 = x, y8 = y;
  for (float& p : x8.pixels()) p *= 8.0f;
  for (float& p : y8.pixels()) p *= 8.0f;
  CHECK(ssim(x8, y8, 16.0) == Approx(ssim(x, y, 2.0)).epsilon(1e-12));
}

TEST_CASE("SSIM refuses what cannot be compared") {
  CHECK_THROWS_AS(ssim(noise(3, 4, 1), noise(4, 3, 1), 1.0), UsageError);
  CHECK_THROWS_AS(ssim(noise(3, 4, 1), noise(3, 4, 1), 0.0), UsageError);
  CHECK_THROWS_AS(ssim(noise(3, 4, 1), noise(3, 4, 1), INFINITY), UsageError);
  CHECK_THROWS_AS(ssim(Image<float>(), Image<float>(), 1.0), UsageError);
}
