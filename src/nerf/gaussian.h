// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

namespace sarnerf {

/// The image smoothed by a Gaussian (standard deviation in pixels, cut at three of them), pixels counting as much as
/// their weights; `otherwise` where there is next to no weight around. The border ends the image. Cost: separable.
Image<float> weighted_gaussian(const Image<float>& image, const Image<float>& weight, double sigma, double otherwise);

}  // namespace sarnerf
