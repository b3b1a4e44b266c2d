// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/evaluation.h"

#include <cmath>
#include <random>
#include <vector>

#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

TEST_CASE("the interval of paired differences is that of Student's t", "[statistics]") {
  // Student's own example (1908): hours of sleep gained by the second drug over the first. t = 4.06, p = 0.0028 with nine
  // degrees of freedom.
  const std::vector<double> gains{1.2, 2.4, 1.3, 1.3, 0.0, 1.0, 1.8, 0.8, 4.6, 1.4};
  const PairedDifference d = paired_difference(gains);
  CHECK(d.n == 10);
  CHECK(d.mean == Approx(1.58));
  CHECK(d.low == Approx(0.7001).epsilon(1e-3));
  CHECK(d.high == Approx(2.4599).epsilon(1e-3));
  CHECK(d.p == Approx(0.00283).epsilon(5e-3));
}

TEST_CASE("intervals hold the true difference in 95 % of studies, and find the smallest detectable one in 80 %", "[statistics]") {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  constexpr int kStudies = 4000, kDraws = 10;
  int n_held = 0, n_found = 0;
  // The smallest detectable difference for a known scatter of 1.
  double detectable = 0.0;
  for (int k = 0; k < kStudies; ++k) {
    std::vector<double> d(kDraws);
    for (double& x : d) x = 0.3 + noise(random);
    const PairedDifference r = paired_difference(d);
    n_held += r.low <= 0.3 && 0.3 <= r.high;
    detectable += r.smallest_detectable / kStudies;
  }
  for (int k = 0; k < kStudies; ++k) {
    std::vector<double> d(kDraws);
    for (double& x : d) x = detectable + noise(random);
    n_found += paired_difference(d).low > 0.0;
  }
  CHECK(n_held == Approx(0.95 * kStudies).margin(0.012 * kStudies));
  CHECK(n_found == Approx(0.8 * kStudies).margin(0.04 * kStudies));
}

TEST_CASE("one pair has no interval, and equal pairs no scatter", "[statistics]") {
  CHECK(std::isinf(paired_difference(std::vector{0.5}).high));
  CHECK(paired_difference(std::vector{0.5}).p == 1.0);
  CHECK(paired_difference(std::vector{0.5, 0.5, 0.5}).p == 0.0);
  CHECK(paired_difference(std::vector{0.0, 0.0}).p == 1.0);
  CHECK_THROWS_AS(paired_difference(std::vector<double>{}), UsageError);
}

TEST_CASE("Holm's method raises the smallest value by their number, and keeps the order", "[statistics]") {
  const std::vector<double> raised = holm(std::vector{0.01, 0.04, 0.03, 0.005});
  CHECK(raised[3] == Approx(0.02));
  CHECK(raised[0] == Approx(0.03));
  CHECK(raised[2] == Approx(0.06));
  CHECK(raised[1] == Approx(0.06));
  CHECK(holm(std::vector{0.9, 0.8})[0] == 1.0);
  CHECK(holm({}).empty());
}

TEST_CASE("the jackknife's error of a mean is its standard error", "[statistics]") {
  const std::vector<double> samples{1.0, 4.0, 2.5, 7.0, 3.5};
  std::vector<double> without_one;
  for (const double x : samples) without_one.push_back((18.0 - x) / 4.0);
  double squares = 0.0;
  for (const double x : samples) squares += (x - 3.6) * (x - 3.6);
  CHECK(jackknife_error(without_one) == Approx(std::sqrt(squares / 4.0 / 5.0)));
  CHECK_THROWS_AS(jackknife_error(std::vector{1.0}), UsageError);
}
