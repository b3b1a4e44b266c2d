// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf::app {

/// A PNG for the eye: images side by side, and last the difference of a prediction from its truth. Images in decibels of one
/// scale, white at `white`, of power; the difference is linear in what truth and prediction hold, prediction minus truth: red
/// above, blue below, grey where equal, full colour at a quarter of `peak`. All of one size.
std::vector<std::byte> comparison_picture(std::span<const Image<float>* const> images, const Image<float>& truth,
                                          const Image<float>& prediction, float white, float peak);

}  // namespace sarnerf::app
