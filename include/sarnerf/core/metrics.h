// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Error of a power image against its reference: E = ‖I − I*‖₂ / ‖I*‖₂. Zero for two blank images,
/// infinite for a blank reference alone. Throws UsageError when the sizes differ. One pass.
double relative_l2_error(const Image<float>& image, const Image<float>& reference);

/// Percentile (0 to 100) of |10 log₁₀(I / I*)| (dB) over the pixels whose reference lies within
/// `range_db` of its peak: what the eye sees in a displayed image, where E sees the brightest pixels
/// only. Infinite when that share of the pixels is missing (zero) in the image; zero for a blank
/// reference. Throws UsageError when the sizes differ. Cost: linear.
double db_error_percentile(const Image<float>& image, const Image<float>& reference,
                           double percentile = 95.0, double range_db = 30.0);

/// 10 log₁₀(peak² / mean (I − I*)²) (dB), of whatever quantity the images hold. The peak is the caller's
/// to name: by convention the maximum over the training images, not over this one. Infinite for equal
/// images. Throws UsageError when the sizes differ or the peak is not positive.
double psnr_db(const Image<float>& image, const Image<float>& reference, double peak);

/// Root mean square of the difference in decibels, of 20 log₁₀ of the amplitudes √I, which is 10 log₁₀ I:
///
///     √ mean (d(I) − d(I*))²    d(I) = 10 log₁₀ max(I / peak, 10^(−range_db/10))
///
/// What a picture in decibels shows: shadows and clutter count as much as the target, and multiplicative speckle
/// has one deviation wherever it stands (5.57 dB for one look). Below the floor all is equally dark. Throws
/// UsageError when sizes differ, for images without pixels, and where peak or range are not positive.
double log_amplitude_error_db(const Image<float>& power, const Image<float>& reference, double peak,
                              double range_db = 40.0);

}  // namespace sarnerf
