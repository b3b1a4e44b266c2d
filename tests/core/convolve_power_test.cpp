// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/impulse_response.h"

#include <random>

#include "catch.h"
#include "sarnerf/core/image.h"

using namespace sarnerf;

namespace {

constexpr int kRows = 17, kBins = 23;

Image<float> random_image(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(0.0f, 1.0f);
  Image<float> image(kRows, kBins);
  for (float& p : image.pixels()) p = value(random);
  return image;
}

ImpulseResponse response_of(const char* window) {
  return impulse_response({0.5, 0.8, window_from_text(window)}, 0.3, 0.2);
}

double tap2(const Kernel& kernel, int n) {
  if (std::abs(n) > kernel.reach()) return 0.0;
  const double tap = kernel.taps[static_cast<std::size_t>(kernel.reach() + n)];
  return tap * tap;
}

double product(const Image<float>& a, const Image<float>& b) {
  double total = 0.0;
  for (std::size_t n = 0; n < a.pixels().size(); ++n) total += double{a.pixels()[n]} * double{b.pixels()[n]};
  return total;
}

}  // namespace

TEST_CASE("the response of power is the sum over all pixels of squared taps") {
  for (const char* window : {"none", "taylor:-35"}) {
    const ImpulseResponse response = response_of(window);
    const Image<float> image = random_image(1);
    Image<float> seen = image;
    convolve_power(seen, response);
    for (int i = 0; i < kRows; i += 4)
      for (int j = 0; j < kBins; j += 3) {
        double expected = 0.0;
        for (int m = 0; m < kRows; ++m)
          for (int n = 0; n < kBins; ++n)
            expected += tap2(response.azimuth, i - m) * tap2(response.range, j - n) * double{image(m, n)};
        CHECK(seen(i, j) == Approx(expected).epsilon(1e-5));
      }
  }
}

TEST_CASE("the response of power is its own adjoint") {
  const ImpulseResponse response = response_of("taylor:-35");
  const Image<float> a = random_image(2), b = random_image(3);
  Image<float> a_seen = a, b_seen = b;
  convolve_power(a_seen, response);
  convolve_power(b_seen, response);
  CHECK(product(a_seen, b) == Approx(product(a, b_seen)).epsilon(1e-6));
}

TEST_CASE("an image without its border is its middle") {
  Image<int> image(7, 9);
  for (int i = 0; i < 7; ++i)
    for (int j = 0; j < 9; ++j) image(i, j) = 10 * i + j;
  const Image<int> inside = without_border(image, {2, 1});
  REQUIRE(inside.n_azimuth() == 3);
  REQUIRE(inside.n_range() == 7);
  CHECK(inside(0, 0) == 21);
  CHECK(inside(2, 6) == 47);
}

TEST_CASE("a border holds all but a hundredth of a response and never more than an image") {
  const ImpulseResponse response = response_of("none");
  const Border border = border_of(response, 1000, 1000);
  double inside = 0.0;
  for (int n = -border.range; n <= border.range; ++n) inside += tap2(response.range, n);
  CHECK(inside >= 0.99);
  CHECK(border_of(response, 3, 2).azimuth <= 3);
  CHECK(border_of(response, 3, 2).range == 2);
}
