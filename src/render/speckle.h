// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sarnerf/core/image.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/core/impulse_response.h"
#include "white_noise.h"

namespace sarnerf {

/// Replaces mean power by Σ_m a_m |h ⊛ (√β⁰ w_m) + n_m|². `noise_power` holds one value per range bin, or
/// nothing: then no noise is made.
void apply_speckle(Image<float>& beta0, const ImpulseResponse& response, std::span<const double> look_weights,
                   std::span<const double> noise_power, const WhiteNoise& random, const Monitor& monitor);

}  // namespace sarnerf
