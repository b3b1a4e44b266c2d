// SPDX-License-Identifier: Apache-2.0
// The depth of a segment through the medium of a surface: closed form against quadrature, derivatives against differences.
#include <algorithm>
#include <cmath>
#include <random>

#include "catch.h"
#include "sarnerf/mpa/surface_density.h"

using namespace sarnerf;

namespace {

/// ∫ Ψ(−s f) over f from `from` to `to`, by Gauss's rule of five points on parts of a sharpness.
long double integral(long double from, long double to, long double sharpness) {
  constexpr long double kAt[] = {0.0L, 0.5384693101056830910363144L, 0.9061798459386639927976269L};
  constexpr long double kWeight[] = {0.5688888888888888888888889L, 0.4786286704993664680412915L, 0.2369268850561890875142640L};
  const auto psi = [&](long double f) {
    const long double u = sharpness * f;
    return u >= 0.0L ? 0.5L * std::exp(-u) : 1.0L - 0.5L * std::exp(u);
  };
  const int n = 1 + static_cast<int>(std::min(2000.0L, 2.0L * std::abs(to - from) * sharpness));
  long double sum = 0.0L;
  for (int part = 0; part < n; ++part) {
    const long double step = (to - from) / n, middle = from + (part + 0.5L) * step;
    for (int k = 0; k < 3; ++k) {
      sum += 0.5L * step * kWeight[k] * psi(middle + 0.5L * step * kAt[k]);
      if (k > 0) sum += 0.5L * step * kWeight[k] * psi(middle - 0.5L * step * kAt[k]);
    }
  }
  return sum;
}

/// The mean of Ψ(−s f) on the segment; the kink at f = 0 is an end of the parts.
long double mean(double near_m, double far_m, double sharpness) {
  if (near_m == far_m) return integral(near_m, near_m + 1e-9L / sharpness, sharpness) / (1e-9L / sharpness);
  const bool through = (near_m < 0.0) != (far_m < 0.0);
  const long double all = through ? integral(near_m, 0.0L, sharpness) + integral(0.0L, far_m, sharpness)
                                  : integral(near_m, far_m, sharpness);
  return all / (static_cast<long double>(far_m) - static_cast<long double>(near_m));
}

}  // namespace

TEST_CASE("depth of a segment is the integral of its extinction, from 1 to 1e4 per metre") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double worst = 0.0, worst_derivative = 0.0;
  for (int n = 0; n < 4000; ++n) {
    const double sharpness = std::pow(10.0, 2.0 + 2.0 * uniform(random));
    const double near_m = 12.0 * uniform(random) / sharpness;
    const double far_m = near_m + 12.0 * uniform(random) * std::pow(10.0, 3.0 * uniform(random) - 2.0) / sharpness;
    const double length_m = 0.3;
    const SurfaceDepth at = surface_depth(near_m, far_m, length_m, sharpness);
    const auto expected = static_cast<double>(mean(near_m, far_m, sharpness)) * length_m * sharpness;
    worst = worse(worst, std::abs(at.depth / expected - 1.0));
    const double step = 1e-4 / sharpness, scale = 0.25 * sharpness * sharpness * length_m;
    const auto depth = [&](double a, double b) { return surface_depth(a, b, length_m, sharpness).depth; };
    const double by_near = (depth(near_m + step, far_m) - depth(near_m - step, far_m)) / (2.0 * step);
    const double by_far = (depth(near_m, far_m + step) - depth(near_m, far_m - step)) / (2.0 * step);
    worst_derivative = worse(worst_derivative, std::abs(at.by_near - by_near) / scale);
    worst_derivative = worse(worst_derivative, std::abs(at.by_far - by_far) / scale);
  }
  CHECK(worst < 1e-11);
  CHECK(worst_derivative < 1e-6);
}

TEST_CASE("depth of a segment stays finite and ordered at the extremes") {
  for (const double sharpness : {1.0, 1e4, 1e8}) {
    for (const double near_m : {-1e3, -1.0, 0.0, 1e-12, 1.0, 1e3}) {
      for (const double far_m : {-1e3, -1.0, 0.0, -1e-12, 1.0, 1e3}) {
        const SurfaceDepth at = surface_depth(near_m, far_m, 0.2, sharpness);
        CHECK(std::isfinite(at.depth));
        CHECK(at.depth >= 0.0);
        CHECK(at.depth <= 0.2 * sharpness);
        // Matter becomes thinner where distances grow.
        CHECK(at.by_near <= 0.0);
        CHECK(at.by_far <= 0.0);
        CHECK(std::isfinite(at.by_near + at.by_far));
      }
    }
  }
  CHECK(surface_depth(-5.0, -5.0, 0.2, 1e4).depth == Approx(2000.0));
  CHECK(surface_depth(0.0, 0.0, 0.2, 10.0).depth == Approx(1.0));
  CHECK(surface_depth(0.1, 0.2, 0.0, 10.0).depth == 0.0);
}
