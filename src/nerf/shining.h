// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

namespace sarnerf {

/// How far a rendered image shines, pixel by pixel: 0 up to twice the ground's brightness, blurred by a pixel, 1 from four
/// times.
Image<float> shining(const Image<float>& power, double ground_power);

}  // namespace sarnerf
