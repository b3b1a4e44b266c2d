// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Where target and shadow of an image with a background are. The thresholds were set by looking at masks of one
/// vehicle (docs/metrics.md), and are fixed: no image chooses its own.
struct RegionRule {
  double blur_pixels = 1.5;  ///< σ of gaussian_blur(), so that speckle does not decide pixel by pixel
  double target_db = 7.0;    ///< the target is that much above the background
  double shadow_db = 4.0;    ///< the shadow is that much below
};

/// Masks of 1 and 0, and what they refer to.
struct Regions {
  double background_power = 0.0;  ///< median of the blurred image
  Image<std::uint8_t> target, shadow, background;  ///< the background is what is neither
};

/// The regions of a power image P, with B = gaussian_blur(P) and b = median B:
///
///     target  B > b 10^(target_db/10)    shadow  B < b 10^(−shadow_db/10)
///
/// A factor on the image changes nothing. None where the median is 0: such an image has no background. Throws
/// UsageError for thresholds that are not positive. Cost: the blur's.
std::optional<Regions> find_regions(const Image<float>& power, const RegionRule& rule = {});

/// |A ∩ B| / |A ∪ B| of the pixels that are not 0; none where both masks are empty. Throws UsageError when sizes
/// differ.
std::optional<double> intersection_over_union(const Image<std::uint8_t>& a,
                                              const Image<std::uint8_t>& b);

}  // namespace sarnerf
