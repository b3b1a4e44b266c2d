// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Structural similarity of an image to its reference (Wang et al. 2004), 1 for equal images:
///
///     mean over windows of (2 μx μy + C1)(2 σxy + C2) / ((μx² + μy² + C1)(σx² + σy² + C2))
///     C1 = (0.01 peak)²   C2 = (0.03 peak)²
///
/// with Gaussian windows of 11 × 11 pixels (σ 1.5 pixels, weights of sum 1, moments weighted by them). Only
/// windows inside the image count: there are (n_azimuth − 10)(n_range − 10) of them, and nothing is padded.
/// Along a side of fewer than 11 pixels the window is the Gaussian's middle, as long as that side. The peak
/// is the dynamic range of whatever quantity the images hold, the caller's to name as in psnr_db(). Throws
/// UsageError when the sizes differ, for images without pixels, and for a peak that is not positive and finite.
/// Cost: 110 multiplications and additions a pixel in double, a few rows of memory.
double ssim(const Image<float>& image, const Image<float>& reference, double peak);

}  // namespace sarnerf
