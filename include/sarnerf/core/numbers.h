// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <ranges>
#include <string>
#include <vector>

/// Order statistics. Each function reorders the values, in O(n), and returns one of them, without interpolation.
namespace sarnerf {

/// The value at index `rank` (from 0) in ascending order, or in the order of `less`. There must be more than `rank` values.
template <std::ranges::random_access_range Values, class Less = std::less<>>
std::ranges::range_value_t<Values> value_of_rank(Values&& values, std::size_t rank, Less less = {}) {
  const auto place = std::ranges::begin(values) + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(std::ranges::begin(values), place, std::ranges::end(values), less);
  return *place;
}

/// The value in the middle; the upper one of the two for an even number of values; zero for an empty range.
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> median(Values&& values) {
  const auto n = static_cast<std::size_t>(std::ranges::size(values));
  return n == 0 ? std::ranges::range_value_t<Values>{} : value_of_rank(values, n / 2);
}

/// The smallest value that at least a fraction `share`, in [0, 1], of the values do not exceed: the ⌈share n⌉-th. There
/// must be a value.
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> quantile_reached(Values&& values, double share) {
  const auto last = static_cast<std::ptrdiff_t>(std::ranges::size(values)) - 1;
  const double place = std::ceil(share * static_cast<double>(last + 1));
  const auto rank = std::clamp(static_cast<std::ptrdiff_t>(place) - 1, std::ptrdiff_t{0}, last);
  return value_of_rank(values, static_cast<std::size_t>(rank));
}

/// The quantile at a fraction `share`, in [0, 1]: the value of rank ⌊share (n − 1)⌋. There must be a value.
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> quantile_below(Values&& values, double share) {
  const auto last = static_cast<double>(std::ranges::size(values) - 1);
  return value_of_rank(values, static_cast<std::size_t>(share * last));
}

}  // namespace sarnerf

namespace sarnerf {

/// Up to `most` of the indices below `count`, ascending, each in the middle of an equal part.
std::vector<std::size_t> spread_indices(std::size_t count, std::size_t most);

/// Position of the top of the parabola through three values at −1, 0 and 1, of which the middle one is the largest: in
/// [−0.5, 0.5]. 0 where the three are equal.
inline double top_of_parabola(double before, double middle, double after) {
  const double bend = before - 2.0 * middle + after;
  return bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

}  // namespace sarnerf

/// Numbers that people read easily.
namespace sarnerf {

/// 1, 2 or 5 times a power of ten.
struct RoundNumber {
  int digit = 1;
  int power = 0;

  double value() const { return digit * std::pow(10.0, power); }
  std::string text() const;  ///< "200", "0.05"
};

/// The largest round number that is not above a positive value.
RoundNumber round_below(double value);

/// The smallest round number that is not below a value, or below it by a millionth at most; 1 for a value that is not
/// positive and finite.
double round_above(double value);

/// m × 10^e written out, for m of zero or more: "250", "0.025".
std::string decimal_text(long long m, int e);

}  // namespace sarnerf
