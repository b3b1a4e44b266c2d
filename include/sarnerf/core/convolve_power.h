// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/core/monitor.h"

namespace sarnerf {

/// Σ |h_n|² of the mean power around each pixel, in place (F4 in docs/image_formation.md). Nothing comes in from beyond the
/// borders, and what leaks out is lost. Being symmetric, it is its own adjoint.
///
/// The same bits for any number of threads and instruction set. Cost: O(pixels × taps); rows and pixels of no power are
/// skipped. Values may be negative.
void convolve_power(Image<float>& power, const ImpulseResponse& response, const Monitor& monitor = {});

}  // namespace sarnerf
