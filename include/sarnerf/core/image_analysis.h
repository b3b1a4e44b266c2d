// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Gaussian blur: the mean around each pixel with weights exp(−d²/2σ²), d in pixels, out to 3σ along rows and
/// columns. At the border the weights inside the image are normalised, so that a flat image stays flat up to its
/// edge. σ = 0 returns the image itself, bit by bit. Throws UsageError for a σ that is negative or not finite. Cost:
/// 6σ + 1 multiplications a pixel and axis.
Image<float> gaussian_blur(const Image<float>& image, double sigma_pixels);

/// A plane of intermediate values. `row_used` is 0 for rows that hold only zeros; they are skipped.
struct Plane {
  Plane(int n_azimuth, int n_range)
      : values(n_azimuth, n_range), row_used(static_cast<std::size_t>(n_azimuth), 0) {}
  Image<float> values;
  std::vector<char> row_used;
};

/// Adds value × taps, centred on element j, to a row; taps outside the row are dropped.
void spread(double value, std::span<const double> taps, int j, std::span<double> row);

/// sum = Σ_n taps_n × row (i − n) of the plane: one row of its convolution along azimuth. The sums are in
/// double and in order of rows.
void gather_rows(const Plane& plane, std::span<const double> taps, int i, std::span<double> sum);

/// Selection of local maxima.
struct MaximaRule {
  int most = 5;               ///< largest number of maxima; the strongest are kept
  double separation_m = 1.0;  ///< least distance of two; of nearer ones the stronger stays, which removes side lobes
  double azimuth_spacing_m = 1.0, range_spacing_m = 1.0;  ///< of the pixels
};

struct LocalMaximum {
  int i = 0, j = 0;
  float value = 0.0f;
};

/// The strongest pixels above `floor` that none of their eight neighbours exceeds, strongest first; equal ones in
/// image order. Throws UsageError for spacings that are not positive, a negative separation and fewer than
/// one maximum. Cost: nine comparisons a pixel, and the sorting of the maxima.
std::vector<LocalMaximum> strongest_maxima(const Image<float>& image, double floor,
                                           const MaximaRule& rule = {});

/// Mean distance (m) from each maximum of the reference to the nearest one of `others`. Throws UsageError where
/// either is empty.
double mean_distance_m(const std::vector<LocalMaximum>& reference,
                       const std::vector<LocalMaximum>& others, const MaximaRule& rule = {});

/// Thresholds that separate target, shadow and background of an image. They were set by looking at masks of one
/// vehicle (docs/guide/metrics.md), and are the same for every image.
struct RegionRule {
  double blur_pixels = 1.5;  ///< σ of gaussian_blur(), so that speckle does not decide pixel by pixel
  double target_db = 7.0;    ///< target pixels are more than this above the background
  double shadow_db = 4.0;    ///< shadow pixels are more than this below it
};

/// Masks of 1 and 0, and the background power that the thresholds refer to.
struct Regions {
  double background_power = 0.0;  ///< median of the blurred image
  Image<std::uint8_t> target, shadow, background;  ///< the background is every other pixel
};

/// The regions of a power image P, with B = gaussian_blur(P) and b = median B:
///
///     target  B > b 10^(target_db/10)    shadow  B < b 10^(−shadow_db/10)
///
/// A factor on the image does not change the masks. Empty where the median is 0: such an image has no background.
/// Throws UsageError for thresholds that are not positive. Cost: that of the blur.
std::optional<Regions> find_regions(const Image<float>& power, const RegionRule& rule = {});

/// The pixels of a mask that hang together with those next to the middle: which are in the square of 2 `reach_pixels` + 1 about it, or are
/// reached from there in steps along rows and columns that stay in the mask. 1 for these, else 0.
Image<std::uint8_t> connected_to_middle(const Image<std::uint8_t>& mask, int reach_pixels);

/// |A ∩ B| / |A ∪ B| of the pixels that are not 0; empty where both masks are. Throws UsageError when sizes differ.
std::optional<double> intersection_over_union(const Image<std::uint8_t>& a,
                                              const Image<std::uint8_t>& b);

/// Which pixels of an image belong to the target.
struct TargetRule {
  double share_of_peak = 0.01;  ///< pixels above this fraction of the peak belong to it (−20 dB)
  int dilation_pixels = 3;      ///< and so do pixels within this distance of one, in rows and in columns
};

/// 1 on the target, 0 elsewhere: the pixels of the reference above a fraction of its peak, dilated by a square of
/// 2 dilation_pixels + 1, so that the mask includes power that an estimate smears beside the target. All 0 for a
/// blank reference. Throws UsageError for a fraction outside [0, 1) and for a negative dilation. Cost: linear in
/// pixels, independent of the dilation.
Image<std::uint8_t> target_mask(const Image<float>& reference, const TargetRule& rule = {});

/// psnr_db() over the pixels where the mask is not 0; empty where it is 0 everywhere. Throws UsageError when
/// sizes differ or the peak is not positive.
std::optional<double> masked_psnr_db(const Image<float>& image, const Image<float>& reference,
                                     double peak, const Image<std::uint8_t>& mask);

}  // namespace sarnerf
