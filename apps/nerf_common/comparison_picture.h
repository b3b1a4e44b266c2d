// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf::app {

/// A PNG for the eye: truth, prediction and their difference side by side. The first two in decibels of one scale, white
/// at `white`; the difference is linear in power, prediction minus truth: red above, blue below, grey where equal, full
/// colour at a quarter of `peak`. Images of power and of one size.
std::vector<std::byte> comparison_picture(const Image<float>& truth, const Image<float>& prediction,
                                          float white, float peak);

}  // namespace sarnerf::app
