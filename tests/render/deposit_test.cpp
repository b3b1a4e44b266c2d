// SPDX-License-Identifier: Apache-2.0

#include <numeric>
#include <random>
#include <vector>

#include "catch.h"
#include "sarnerf/mpa/deposit.h"

using namespace sarnerf;

namespace {

double total(const std::vector<double>& bins) { return std::accumulate(bins.begin(), bins.end(), 0.0); }

/// The trapezoid as what it is: points spread over [x0, x1], each smeared by a box.
std::vector<double> sampled(std::size_t n_bins, double x0, double x1, double smear, double mass) {
  std::vector<double> bins(n_bins, 0.0);
  constexpr int kPoints = 2000;
  for (int p = 0; p < kPoints; ++p) {
    for (int q = 0; q < kPoints; ++q) {
      const double x = x0 + (x1 - x0) * (p + 0.5) / kPoints + smear * ((q + 0.5) / kPoints - 0.5);
      if (x >= 0.0 && x < double(n_bins)) bins[std::size_t(x)] += mass / kPoints / kPoints;
    }
  }
  return bins;
}

}  // namespace

TEST_CASE("a trapezoid agrees with points spread over it", "[deposit]") {
  const double cases[][3] = {{1.2, 3.9, 0.7}, {3.9, 1.2, -0.7}, {2.1, 2.2, 3.3}, {-1.4, 2.5, 0.4},
                             {6.1, 9.0, 1.0}, {2.0, 3.0, 1.0},  {4.0, 4.0, 2.0}};
  for (const auto& c : cases) {
    std::vector<double> bins(8, 0.0);
    deposit_trapezoid(bins, c[0], c[1], c[2], 2.5);
    const auto expected = sampled(8, c[0], c[1], c[2], 2.5);
    for (std::size_t j = 0; j < 8; ++j) CHECK(bins[j] == Approx(expected[j]).margin(2e-3));
  }
}

TEST_CASE("mass inside the bins is conserved at every aspect ratio", "[deposit]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> position(20.0, 40.0), exponent(-12.0, 1.0);
  for (int n = 0; n < 2000; ++n) {
    std::vector<double> bins(64, 0.0);
    const double x0 = position(random);
    const double x1 = x0 + std::pow(10.0, exponent(random));
    const double smear = n % 5 == 0 ? 0.0 : std::pow(10.0, exponent(random));
    deposit_trapezoid(bins, x0, n % 7 == 0 ? x0 : x1, smear, 3.0);
    CHECK(total(bins) == Approx(3.0).epsilon(1e-12));
    for (const double b : bins) CHECK(b >= 0.0);
  }
}

TEST_CASE("mass outside the bins is dropped, and never wraps", "[deposit]") {
  std::vector<double> bins(4, 0.0);
  deposit_trapezoid(bins, -9.0, -5.0, 1.0, 1.0);
  deposit_trapezoid(bins, 5.0, 1e30, 1.0, 1.0);
  deposit_trapezoid(bins, -1e30, -1e29, 1e10, 1.0);
  CHECK(total(bins) == 0.0);
  deposit_trapezoid(bins, -2.0, 2.0, 0.0, 1.0);
  CHECK(total(bins) == Approx(0.5));
}
