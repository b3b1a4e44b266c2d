// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace sarnerf {

/// Integral of a unit-mass trapezoid, the convolution of boxes of widths `wide` ≥ `narrow`, from its
/// left end to y.
struct TrapezoidIntegral {
  double wide, narrow, inverse_wide, inverse_ramp;

  TrapezoidIntegral(double a, double b)
      : wide(std::max(a, b)),
        narrow(std::min(a, b)),
        inverse_wide(1.0 / wide),
        // Ramps below a millionth of the plateau are steps: their integrals differ by less than that.
        inverse_ramp(narrow > 1e-6 * wide ? 0.5 / (wide * narrow) : 0.0) {}

  double operator()(double y) const {
    const double rest = wide + narrow - y;
    if (y <= 0.0) return 0.0;
    if (rest <= 0.0) return 1.0;
    if (y < narrow) return y * y * inverse_ramp;
    if (rest < narrow) return 1.0 - rest * rest * inverse_ramp;
    return (y - 0.5 * narrow) * inverse_wide;
  }
};

/// Calls f(j, share) for each of the bins [0, n_bins) that a uniform density on [x0, x1] (either order),
/// smeared by a box of width |smear|, touches; bin j covers [j, j + 1). Shares of all bins, also those
/// outside, add up to 1.
template <class F>
void for_each_share(std::size_t n_bins, double x0, double x1, double smear, F&& f) {
  const double width = std::abs(smear);
  const double first = std::min(x0, x1) - 0.5 * width;
  const double last = std::max(x0, x1) + 0.5 * width;
  const double end_of_bins = static_cast<double>(n_bins);
  if (!(last >= 0.0 && first < end_of_bins)) return;

  const double first_bin = std::floor(first);
  if (last < first_bin + 1.0) {  // the commonest case: all in one bin
    f(static_cast<std::size_t>(first_bin), 1.0);
    return;
  }
  const TrapezoidIntegral integral(std::abs(x1 - x0), width);
  const auto begin = static_cast<std::ptrdiff_t>(std::max(first_bin, 0.0));
  const auto end = static_cast<std::ptrdiff_t>(std::min(std::floor(last) + 1.0, end_of_bins));
  double below = integral(static_cast<double>(begin) - first);
  for (std::ptrdiff_t j = begin; j < end; ++j) {
    const double above = integral(static_cast<double>(j + 1) - first);
    f(static_cast<std::size_t>(j), above - below);
    below = above;
  }
}

/// Spreads `mass` over range bins: a uniform density on [x0, x1] (either order) smeared by a box of
/// width |smear|, all in bin coordinates, where bin j covers [j, j + 1). Exact integration of that
/// trapezoid over each bin; what falls outside the bins is dropped.
///
/// This is what makes the image free of aliasing with few rays: between neighbouring rays a plane spans
/// the interval [x0, x1], and over the width of a sub-row it moves by `smear`.
/// Cost: a few ns, plus about 2 ns for each bin touched.
inline void deposit_trapezoid(std::span<double> bins, double x0, double x1, double smear, double mass) {
  for_each_share(bins.size(), x0, x1, smear,
                 [&](std::size_t j, double share) { bins[j] += mass * share; });
}

}  // namespace sarnerf
