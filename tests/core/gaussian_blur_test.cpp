// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/image_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "speckle.h"

using namespace sarnerf;

TEST_CASE("a blurred point is the Gaussian, of the same sum") {
  const double sigma = GENERATE(0.7, 1.0, 1.5, 2.0);
  Image<float> point(31, 25);
  point(15, 12) = 3.0f;
  const Image<float> blurred = gaussian_blur(point, sigma);
  double sum = 0.0;
  for (const float p : blurred.pixels()) sum += double(p);
  CHECK(sum == Approx(3.0).epsilon(1e-6));
  for (const int d : {1, 2}) {
    const double expected = std::exp(-0.5 * d * d / (sigma * sigma));
    CHECK(double(blurred(15 + d, 12)) == Approx(double(blurred(15, 12)) * expected).epsilon(1e-6));
    CHECK(double(blurred(15, 12 - d)) == Approx(double(blurred(15, 12)) * expected).epsilon(1e-6));
  }
  // The continuous Gaussian's peak, but for what sums of samples differ from integrals.
  if (sigma >= 1.0) CHECK(double(blurred(15, 12)) == Approx(3.0 / (2.0 * M_PI * sigma * sigma)).epsilon(0.01));
  CHECK(blurred(15, 12 + static_cast<int>(std::ceil(3.0 * sigma)) + 1) == 0.0f);
}

TEST_CASE("a flat image stays flat up to its edge, however large the blur") {
  const Image<float> flat(9, 4, 0.7f);
  for (const double sigma : {0.7, 3.0, 1e6}) {
    const Image<float> blurred = gaussian_blur(flat, sigma);
    for (const float p : blurred.pixels())
      CHECK(double(p) == Approx(double(0.7f)).epsilon(1e-6));
  }
}

TEST_CASE("no blur is the image itself, and odd ones are refused") {
  const Image<float> image = test::speckle(12, 1, 0.0, 3);
  const Image<float> same = gaussian_blur(image, 0.0);
  CHECK(std::equal(same.pixels().begin(), same.pixels().end(), image.pixels().begin()));
  CHECK_THROWS_AS(gaussian_blur(image, -0.1), UsageError);
  CHECK_THROWS_AS(gaussian_blur(image, std::numeric_limits<double>::quiet_NaN()), UsageError);
}

TEST_CASE("blurring averages speckle by as many pixels as its window is wide") {
  // The variance of a mean with weights w is Σ w² of one pixel's, 1/(4πσ²) for a Gaussian.
  const double sigma = 1.5;
  const Image<float> blurred = gaussian_blur(test::speckle(200, 1, 0.0, 7), sigma);
  double sum = 0.0, squares = 0.0;
  int n = 0;
  for (int i = 5; i < 195; ++i) {
    for (int j = 5; j < 195; ++j, ++n) {
      sum += double(blurred(i, j));
      squares += double(blurred(i, j)) * double(blurred(i, j));
    }
  }
  const double mean = sum / n;
  CHECK(mean * mean / (squares / n - mean * mean) ==
        Approx(4.0 * M_PI * sigma * sigma).epsilon(0.05));
}
