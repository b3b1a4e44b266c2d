// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// How looks are counted.
struct LooksRule {
  int window_pixels = 7;  ///< side of the square windows
  int step_pixels = 3;    ///< from one window to the next
  double quantile = 0.5;  ///< of the windows' values; higher ones leave out more texture and more edges
};

/// What stands for "no speckle at all" where a finite number is needed: nothing measured has so many looks.
inline constexpr double kMostLooks = 1e4;

/// Equivalent number of looks of a power image, the number of independent images whose average fluctuates as much
/// (Oliver and Quegan 1998, section 4.3):
///
///     L = quantile over windows of m² / s²    m the mean of a window's n pixels, s² their variance over n − 1
///
/// Fully developed speckle of L looks is a gamma distribution with m²/σ² = L. What is not flat, such as a target, an
/// edge or texture, only adds to s², so a middling or high quantile is what the flat parts show. `only`, where given,
/// leaves windows out that hold a pixel of value 0 there; windows without power are left out, too. None where no window
/// is left. At most kMostLooks.
///
/// Bias. The mean of s²/m² is known in closed form, (1/L) / (1 + 1/(nL)) for independent pixels: for a gamma sample,
/// m is independent of s²/m². The median of m²/s² lies above L since s² is skewed: by 5 % for one look, 2 % for four;
/// the quantile 0.9 by 46 % and 36 %. Correlated pixels share part of their fluctuation with the window's mean, which
/// lacks in s²: 1/L shrinks by 1 − ρ̄, ρ̄ the mean correlation over all pairs of different pixels of a window, and the
/// skew grows. Where the correlation falls as exp(−d²/2c²), c = 1.5 pixels, the median is 48 % and 36 % too high.
///
/// Throws UsageError where the mask has another size, for windows of fewer than two pixels' side, steps below one and
/// quantiles outside [0, 1]. Cost: n / step² additions a pixel.
std::optional<double> equivalent_looks(const Image<float>& power, const LooksRule& rule = {},
                                       const Image<std::uint8_t>* only = nullptr);

}  // namespace sarnerf
