// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/numbers.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace sarnerf {

std::vector<std::size_t> spread_indices(std::size_t count, std::size_t most) {
  const std::size_t n = std::min(count, most);
  std::vector<std::size_t> indices(n);
  for (std::size_t k = 0; k < n; ++k) indices[k] = (2 * k + 1) * count / (2 * n);
  return indices;
}

std::string decimal_text(long long m, int e) {
  std::string digits = std::to_string(m);
  if (e >= 0 && m != 0) digits.append(static_cast<std::size_t>(e), '0');
  if (e < 0) {
    const auto decimals = static_cast<std::size_t>(-e);
    if (digits.size() <= decimals) digits.insert(0, decimals + 1 - digits.size(), '0');
    digits.insert(digits.size() - decimals, ".");
  }
  return digits;
}

std::string RoundNumber::text() const { return decimal_text(digit, power); }

RoundNumber round_below(double value) {
  const int power = static_cast<int>(std::floor(std::log10(value)));
  const double decade = std::pow(10.0, power);
  return {value >= 5.0 * decade ? 5 : value >= 2.0 * decade ? 2 : 1, power};
}

double round_above(double value) {
  if (!(value > 0.0 && std::isfinite(value))) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (value <= digit * decade * (1.0 + 1e-6)) return digit * decade;
  }
  return 10.0 * decade;
}

}  // namespace sarnerf
