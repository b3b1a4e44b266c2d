// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Error of a power image against its reference: E = ‖I − I*‖₂ / ‖I*‖₂. Zero for two blank images,
/// infinite for a blank reference alone. Throws UsageError when the sizes differ. One pass.
double relative_l2_error(const Image<float>& image, const Image<float>& reference);

/// Percentile (0 to 100) of |10 log₁₀(I / I*)| (dB) over the pixels whose reference lies within
/// `range_db` of its peak. It measures what is visible in a displayed image; E depends on the brightest
/// pixels only. Infinite when more than 100 − percentile percent of these pixels are zero in the image;
/// zero for a blank reference. Throws UsageError when the sizes differ, and for a percentile outside
/// [0, 100]. Cost: linear.
double db_error_percentile(const Image<float>& image, const Image<float>& reference,
                           double percentile = 95.0, double range_db = 30.0);

/// 10 log₁₀(peak² / mean (I − I*)²) (dB), of whatever quantity the images hold. The caller gives the peak: by
/// convention the maximum over the training images, not over this one. Infinite for equal images. Throws
/// UsageError when the sizes differ or the peak is not positive.
double psnr_db(const Image<float>& image, const Image<float>& reference, double peak);

/// Largest PSNR that a score can have (dB). Equal images would have an infinite PSNR, which neither JSON nor a mean
/// can hold. 100 dB below the peak is far below anything that is displayed or learned.
inline constexpr double kMostPsnr_db = 100.0;

/// psnr_db(), kMostPsnr_db at the most. Of images that are not finite it is not a number.
double capped_psnr_db(const Image<float>& image, const Image<float>& reference, double peak);

/// Root mean square of the difference in decibels, 20 log₁₀ of the amplitudes √I, which is 10 log₁₀ I:
///
///     √ mean (d(I) − d(I*))²    d(I) = 10 log₁₀ max(I / peak, 10^(−range_db/10))
///
/// This is the error visible in an image shown in decibels: shadows and clutter count as much as the target, and
/// multiplicative speckle has the same deviation at every power (5.57 dB for one look). All powers below the floor
/// are equal. Throws UsageError when sizes differ, for images without pixels, and where peak or range are not
/// positive.
double log_amplitude_error_db(const Image<float>& power, const Image<float>& reference, double peak,
                              double range_db = 40.0);

/// Structural similarity of an image to its reference (Wang et al. 2004), 1 for equal images:
///
///     mean over windows of (2 μx μy + C1)(2 σxy + C2) / ((μx² + μy² + C1)(σx² + σy² + C2))
///     C1 = (0.01 peak)²   C2 = (0.03 peak)²
///
/// with Gaussian windows of 11 × 11 pixels (σ 1.5 pixels, weights of sum 1, moments weighted by them). Only
/// windows inside the image count: there are (n_azimuth − 10)(n_range − 10) of them, without padding. Along a
/// side of fewer than 11 pixels the window is the centre of the Gaussian, as long as that side. The peak is the
/// dynamic range of whatever quantity the images hold; the caller gives it as in psnr_db(). Throws UsageError
/// when the sizes differ, for images without pixels, and for a peak that is not positive and finite. Cost: 110
/// multiplications and additions a pixel in double, a few rows of memory.
double ssim(const Image<float>& image, const Image<float>& reference, double peak);

/// Windows of equivalent_looks().
struct LooksRule {
  int window_pixels = 7;  ///< side of the square windows
  int step_pixels = 3;    ///< from one window to the next
  double quantile = 0.5;  ///< of the windows' values; a higher one excludes more texture and more edges
};

/// Finite number of looks that stands for "no speckle": no measured image has as many.
inline constexpr double kMostLooks = 1e4;

/// Equivalent number of looks of a power image, the number of independent images whose average fluctuates as much
/// (Oliver and Quegan 1998, section 4.3):
///
///     L = quantile over windows of m² / s²    m the mean of a window's n pixels, s² their variance over n − 1
///
/// Fully developed speckle of L looks has a gamma distribution with m²/σ² = L. A target, an edge or texture only adds
/// to s², so a medium or high quantile is that of the flat parts. Windows that hold a pixel of value 0 in the mask
/// `only`, where one is given, are left out, and so are windows without power. Empty where no window is left. At most
/// kMostLooks.
///
/// Bias. The mean of s²/m² is known in closed form, (1/L) / (1 + 1/(nL)) for independent pixels: for a gamma sample,
/// m is independent of s²/m². The median of m²/s² lies above L since s² is skewed: by 5 % for one look, 2 % for four;
/// the quantile 0.9 by 46 % and 36 %. If pixels are correlated, part of their fluctuation shifts the window's mean and
/// is missing in s²: 1/L is multiplied by 1 − ρ̄, ρ̄ the mean correlation over all pairs of different pixels of a
/// window, and the skew grows. Where the correlation is exp(−d²/2c²), c = 1.5 pixels, the median is 48 % and 36 % too
/// high.
///
/// Throws UsageError where the mask has another size, for windows of fewer than two pixels' side, steps below one and
/// quantiles outside [0, 1]. Cost: n / step² additions a pixel.
std::optional<double> equivalent_looks(const Image<float>& power, const LooksRule& rule = {},
                                       const Image<std::uint8_t>* only = nullptr);

}  // namespace sarnerf
