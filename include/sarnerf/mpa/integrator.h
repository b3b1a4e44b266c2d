// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace sarnerf {

/// Rule for the contribution of one homogeneous segment of two-way optical depth x, with T the
/// transmittance up to its near end, length ℓ, scattering P, brightness γ = P ℓ / x.
enum class Integrator {
  exact,     ///< P ℓ T (1 − e^−x)/x: exact for a constant segment, stable for every x
  midpoint,  ///< P ℓ T e^(−x/2): second order for small x
  paper,     ///< P ℓ T e^−x: the inclusive product of printed eqs. 6 and 24
  paper_gated,  ///< γ T e^−x tanh x: printed eq. 30 with its inclusive sum; depends on the cell size
};

/// "exact", "midpoint", "paper", "paper-gated".
std::string_view name(Integrator integrator);

/// Inverse of name(). Throws UsageError listing the names that exist.
Integrator integrator_from_name(std::string_view name);

}  // namespace sarnerf
