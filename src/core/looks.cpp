// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/looks.h"

#include <algorithm>
#include <string>
#include <vector>

#include "same_size.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

void check(const LooksRule& rule) {
  if (rule.window_pixels >= 2 && rule.step_pixels >= 1 && rule.quantile >= 0.0 &&
      rule.quantile <= 1.0) {
    return;
  }
  throw UsageError("looks are counted in windows of 2 or more pixels, 1 or more apart, at a quantile "
                   "in [0, 1]; the rule says " +
                   std::to_string(rule.window_pixels) + ", " + std::to_string(rule.step_pixels) +
                   ", " + std::to_string(rule.quantile));
}

bool all_set(const Image<std::uint8_t>& mask, int i0, int j0, int side) {
  for (int i = i0; i < i0 + side; ++i) {
    const auto row = mask.row(i).subspan(static_cast<std::size_t>(j0), static_cast<std::size_t>(side));
    if (std::find(row.begin(), row.end(), std::uint8_t{0}) != row.end()) return false;
  }
  return true;
}

/// None for a window without power.
std::optional<double> looks_of_window(const Image<float>& power, int i0, int j0, int side) {
  // About the first pixel: the sum of squares of a nearly flat window would drown its variance in rounding.
  const double origin = double(power(i0, j0));
  double sum = 0.0, squares = 0.0;
  for (int i = i0; i < i0 + side; ++i) {
    for (int j = j0; j < j0 + side; ++j) {
      const double d = double(power(i, j)) - origin;
      sum += d;
      squares += d * d;
    }
  }
  const double n = double(side) * side, mean = origin + sum / n;
  if (!(mean > 0.0)) return std::nullopt;
  const double variance = (squares - sum * sum / n) / (n - 1.0);
  return mean * mean > kMostLooks * variance ? kMostLooks : mean * mean / variance;
}

}  // namespace

std::optional<double> equivalent_looks(const Image<float>& power, const LooksRule& rule,
                                       const Image<std::uint8_t>* only) {
  check(rule);
  if (only != nullptr) require_same_size(*only, power);
  const int side = rule.window_pixels;
  std::vector<double> looks;
  for (int i = 0; i + side <= power.n_azimuth(); i += rule.step_pixels) {
    for (int j = 0; j + side <= power.n_range(); j += rule.step_pixels) {
      if (only != nullptr && !all_set(*only, i, j, side)) continue;
      if (const auto value = looks_of_window(power, i, j, side)) looks.push_back(*value);
    }
  }
  if (looks.empty()) return std::nullopt;
  const auto place = looks.begin() + static_cast<std::ptrdiff_t>(rule.quantile * double(looks.size() - 1));
  std::nth_element(looks.begin(), place, looks.end());
  return *place;
}

}  // namespace sarnerf
