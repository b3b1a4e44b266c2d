// SPDX-License-Identifier: Apache-2.0
#include "error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "clones.h"
#include "sarnerf/render/error_estimate.h"

namespace sarnerf {
namespace {

/// Sums that run side by side, so that the compiler may vectorise them without changing their order.
constexpr std::size_t kLanes = 16;
using Lanes = std::array<double, kLanes>;

SARNERF_CLONES void add_row(const float* a, const float* b, std::size_t n, double* power, double* difference) {
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
  // Rows lie side by side: what is left over of all of them comes last.
  const auto n_skipped = static_cast<std::size_t>(first_row) * static_cast<std::size_t>(a.n_range());
  const std::span<const float> rest_a = a.pixels().subspan(n_skipped), rest_b = b.pixels().subspan(n_skipped);
  const std::size_t whole = rest_a.size() / kLanes * kLanes;
  add_row(rest_a.data(), rest_b.data(), whole, power.data(), difference.data());
  for (std::size_t n = whole; n < rest_a.size(); ++n) {
    const double d = double(rest_a[n]) - double(rest_b[n]);
    power[0] += double(rest_a[n]) * double(rest_a[n]);
    difference[0] += d * d;
  }
  const double sum = total(power);
  return sum > 0.0 ? std::sqrt(total(difference) / sum) : ErrorEstimate::kUnknown;
}

Image<float> error_map(const Image<float>& a, const Image<float>& b, int first_row, double scale) {
  Image<float> map(a.n_azimuth(), a.n_range());
  for (int i = 0; i < a.n_azimuth(); ++i) {
    const int compared = std::min(std::max(i, first_row), a.n_azimuth() - 1);
    const auto row_a = a.row(compared), row_b = b.row(compared);
    const auto row = map.row(i);
    for (std::size_t j = 0; j < row.size(); ++j) {
      row[j] = static_cast<float>(scale * std::abs(double(row_a[j]) - double(row_b[j])));
    }
  }
  return map;
}

}  // namespace sarnerf
