// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

namespace sarnerf {

/// The image, each pixel the mean of its surroundings with weights exp(−d²/2σ²), d in pixels, out to 3σ along rows
/// and columns. At the border the weights that are left count alone, so that a flat image stays flat up to its edge.
/// σ = 0 is the image itself, bit by bit. Throws UsageError for a σ that is negative or not finite. Cost: 6σ + 1
/// multiplications a pixel and axis.
Image<float> gaussian_blur(const Image<float>& image, double sigma_pixels);

}  // namespace sarnerf
