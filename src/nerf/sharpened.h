// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// What the images would show without their impulse response, as far as each tells by itself: power that is nowhere
/// negative and, seen through the response, is the image (Richardson 1972, Lucy 1974). What is 40 dB below the largest pixel
/// of all, and is no more than the tails that the iteration has not taken away yet, is 0.
///
/// Cost: 240 products of matrices a view. Throws UsageError where a spacing under-samples the resolution.
std::vector<PosedImage> sharpened(const std::vector<PosedImage>& images, const Resolution& resolution);

}  // namespace sarnerf
