// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "sarnerf/core/image.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// What a pixel measures: linear power, or its square root.
enum class Quantity { power, amplitude };

/// The area that backscatter is divided by.
enum class Calibration {
  beta0,         ///< pixel area in the slant plane: radar brightness
  sigma0,        ///< pixel area on the reference plane: β⁰ sin θ_j
  gamma0,        ///< the same seen from the radar: β⁰ tan θ_j
  uncalibrated,  ///< unknown factor; for read data only
};

std::string_view name(Quantity quantity);
std::string_view name(Calibration calibration);

/// Inverses of name(). Throw UsageError listing the names that exist.
Quantity quantity_from_name(std::string_view name);
Calibration calibration_from_name(std::string_view name);

/// Turns β⁰ (linear power, [n_azimuth × n_range]) into σ⁰ or γ⁰ in place:
///
///     σ⁰ = β⁰ sin θ_j    γ⁰ = β⁰ tan θ_j    cos θ_j = H / r_j
///
/// with H (m) the radar's height above the reference plane at `reference_height_m` (world). Bins nearer
/// than H lie above the plane's nadir, where θ_j does not exist; there θ_j = 0 and both vanish.
/// Returns the number of such bins. Throws GeometryError when the radar stands below the plane, and
/// UsageError for `uncalibrated`.
int calibrate(Image<float>& beta0, const Acquisition& acquisition, double reference_height_m,
              Calibration calibration);

/// Power to amplitude in place.
void take_amplitude(Image<float>& power);

}  // namespace sarnerf
