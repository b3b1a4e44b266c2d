// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Which pixels of an image belong to the target.
struct TargetRule {
  double share_of_peak = 0.01;  ///< pixels above this share of the peak belong (−20 dB)
  int dilation_pixels = 3;      ///< and all that near to one, in rows and in columns
};

/// 1 on the target, 0 elsewhere: the pixels of the reference above a share of its peak, dilated by a square of
/// 2 dilation_pixels + 1 so that what an estimate smears beside the target counts as well. All 0 for a blank
/// reference. Throws UsageError for a share outside [0, 1) and for a negative dilation. Cost: linear,
/// whatever the dilation.
Image<std::uint8_t> target_mask(const Image<float>& reference, const TargetRule& rule = {});

/// psnr_db() over the pixels where the mask is not 0; empty where it is 0 everywhere. Throws UsageError when
/// sizes differ or the peak is not positive.
std::optional<double> masked_psnr_db(const Image<float>& image, const Image<float>& reference,
                                     double peak, const Image<std::uint8_t>& mask);

}  // namespace sarnerf
