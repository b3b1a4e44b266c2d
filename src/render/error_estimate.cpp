// SPDX-License-Identifier: Apache-2.0
#include "error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sarnerf/core/clones.h"
#include "sarnerf/render/error_estimate.h"

namespace sarnerf {
namespace {

/// Sums that run side by side, so that the compiler may vectorise them without changing their order.
constexpr std::size_t kLanes = 16;
using Lanes = std::array<double, kLanes>;

SARNERF_CLONES void add_pixels(const float* a, const float* b, std::size_t n, double* power,
                               double* difference) {
  for (std::size_t j = 0; j < n; j += kLanes) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double value = a[j + l], d = value - double(b[j + l]);
      power[l] += value * value;
      difference[l] += d * d;
    }
  }
}

double total(const Lanes& lanes) {
  double sum = 0.0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

}  // namespace

double relative_difference(const Image<float>& a, const Image<float>& b, int first_row) {
  Lanes power{}, difference{};
  const std::size_t skipped = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(a.n_range());
  const std::span<const float> x = a.pixels().subspan(skipped), y = b.pixels().subspan(skipped);
  const std::size_t whole = x.size() / kLanes * kLanes;
  add_pixels(x.data(), y.data(), whole, power.data(), difference.data());
  for (std::size_t n = whole; n < x.size(); ++n) {
    const double value = x[n], d = value - double(y[n]);
    power[0] += value * value;
    difference[0] += d * d;
  }
  const double sum = total(power);
  return sum > 0.0 ? std::sqrt(total(difference) / sum) : ErrorEstimate::kUnknown;
}

Image<float> error_map(const Image<float>& a, const Image<float>& b, int first_row, double scale) {
  Image<float> map(a.n_azimuth(), a.n_range());
  for (int i = first_row; i < a.n_azimuth(); ++i) {
    std::ranges::transform(a.row(i), b.row(i), map.row(i).begin(), [&](float x, float y) {
      return static_cast<float>(scale * std::abs(double(x) - double(y)));
    });
  }
  return map;
}

}  // namespace sarnerf
