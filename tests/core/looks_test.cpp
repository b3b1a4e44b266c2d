// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/metrics.h"

#include <cmath>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "speckle.h"

using namespace sarnerf;
using test::speckle;

namespace {

double looks(const Image<float>& power, const LooksRule& rule = {}) {
  const auto value = equivalent_looks(power, rule);
  REQUIRE(value.has_value());
  return *value;
}

/// Mean of s²/m² over windows of 7 × 7, whose expectation for gamma variables is known.
double mean_contrast(const Image<float>& power) {
  double sum = 0.0;
  int n = 0;
  for (int i = 0; i + 7 <= power.n_azimuth(); i += 7) {
    for (int j = 0; j + 7 <= power.n_range(); j += 7, ++n) {
      Image<float> window(7, 7);
      for (int a = 0; a < 7; ++a)
        for (int b = 0; b < 7; ++b) window(a, b) = power(i + a, j + b);
      sum += 1.0 / looks(window);
    }
  }
  return sum / n;
}

/// Mean correlation over pairs of different pixels of a window of 7 × 7.
double mean_correlation(double c) {
  double sum = 0.0;
  for (int a = 0; a < 49; ++a) {
    for (int b = 0; b < 49; ++b) {
      const double di = a / 7 - b / 7, dj = a % 7 - b % 7;
      if (a != b) sum += std::exp(-0.5 * (di * di + dj * dj) / (c * c));
    }
  }
  return sum / (49.0 * 48.0);
}

}  // namespace

TEST_CASE("windows of gamma variables have the contrast of the closed form") {
  const int n_looks = GENERATE(1, 4);
  const Image<float> power = speckle(7 * 60, n_looks, 0.0, 11);
  // 3600 independent windows: the mean of s²/m² has a relative deviation of some 0.5 %.
  const double expected = (1.0 / n_looks) / (1.0 + 1.0 / (49.0 * n_looks));
  CHECK(mean_contrast(power) == Approx(expected).epsilon(0.02));
}

TEST_CASE("correlated pixels lack the fluctuation that they share") {
  // Four looks: E[s²] = (1 − ρ̄)/L exactly, E[m²] = 1 + var m, var m = (1/L)(1 + 48 ρ̄)/49.
  const double c = 1.5, rho = mean_correlation(c);
  const int n_looks = 4;
  const Image<float> power = speckle(7 * 60, n_looks, c, 12);
  const double of_means = (1.0 + 48.0 * rho) / 49.0 / n_looks;
  // s² and m² are dependent now, by some 2 % for four looks.
  CHECK(mean_contrast(power) ==
        Approx((1.0 - rho) / n_looks / (1.0 + of_means)).epsilon(0.05));
  CHECK(rho > 0.15);  // so that the formula without it would fail
}

TEST_CASE("the bias that is documented is the bias") {
  const auto median = [](int n, double c) { return looks(speckle(300, n, c, 5)) / n; };
  CHECK(median(1, 0.0) == Approx(1.05).epsilon(0.03));
  CHECK(median(4, 0.0) == Approx(1.02).epsilon(0.03));
  CHECK(median(1, 1.5) == Approx(1.48).epsilon(0.06));
  CHECK(median(4, 1.5) == Approx(1.36).epsilon(0.06));
  const LooksRule high{.quantile = 0.9};
  CHECK(looks(speckle(300, 1, 0.0, 5), high) == Approx(1.46).epsilon(0.04));
  CHECK(looks(speckle(300, 4, 0.0, 5), high) == Approx(4.0 * 1.36).epsilon(0.04));
}

TEST_CASE("a target, a shadow and an edge do not change what most windows show") {
  Image<float> power = speckle(210, 4, 0.0, 21);
  const double alone = looks(power);
  for (int i = 80; i < 120; ++i) {
    for (int j = 60; j < 100; ++j) power(i, j) *= 300.0f;
    for (int j = 100; j < 160; ++j) power(i, j) *= 0.01f;
  }
  CHECK(looks(power) == Approx(alone).epsilon(0.05));
}

TEST_CASE("a factor changes nothing, a flat image has the most looks, a blank one none") {
  Image<float> power = speckle(64, 1, 0.0, 2);
  const double before = looks(power);
  for (float& p : power.pixels()) p *= 1024.0f;
  CHECK(looks(power) == Approx(before).epsilon(1e-12));
  CHECK(looks(Image<float>(20, 20, 0.3f)) == kMostLooks);
  CHECK_FALSE(equivalent_looks(Image<float>(20, 20)).has_value());
  CHECK_FALSE(equivalent_looks(Image<float>(6, 20, 1.0f)).has_value());
}

TEST_CASE("a mask leaves out the windows that it touches") {
  // Speckle on the left, flat on the right.
  Image<float> power = speckle(60, 1, 0.0, 4);
  Image<std::uint8_t> left(60, 60), right(60, 60), none(60, 60);
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      (j < 30 ? left : right)(i, j) = 1;
      if (j >= 30) power(i, j) = 1.0f;
    }
  }
  CHECK(*equivalent_looks(power, {}, &left) == Approx(1.05).epsilon(0.15));
  CHECK(*equivalent_looks(power, {}, &right) == kMostLooks);
  CHECK_FALSE(equivalent_looks(power, {}, &none).has_value());
}

TEST_CASE("rules of looks that mean nothing are refused") {
  const Image<float> power(20, 20, 1.0f);
  CHECK_THROWS_AS(equivalent_looks(power, {.window_pixels = 1}), UsageError);
  CHECK_THROWS_AS(equivalent_looks(power, {.step_pixels = 0}), UsageError);
  CHECK_THROWS_AS(equivalent_looks(power, {.quantile = 1.01}), UsageError);
  const Image<std::uint8_t> other(20, 19, 1);
  CHECK_THROWS_AS(equivalent_looks(power, {}, &other), UsageError);
}
