// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace sarnerf {

/// Two-way optical depth of a segment in the medium of a surface, and its derivatives.
struct SurfaceDepth {
  double depth = 0.0;
  double by_near = 0.0, by_far = 0.0;  ///< ∂depth/∂f₀, ∂depth/∂f₁ (1/m)
};

/// Ψ(−u), with Ψ the distribution function of Laplace's distribution of scale 1.
inline double laplace_below(double u) { return u >= 0.0 ? 0.5 * std::exp(-u) : 1.0 - 0.5 * std::exp(u); }

/// (e^z − 1) / z and (e^z − 1 − z) / z², without cancellation near 0.
inline double exponential_mean(double z) { return z == 0.0 ? 1.0 : std::expm1(z) / z; }
inline double exponential_second(double z) {
  if (std::abs(z) > 0.03) return (exponential_mean(z) - 1.0) / z;
  return 1.0 / 2.0 + z * (1.0 / 6.0 + z * (1.0 / 24.0 + z * (1.0 / 120.0 + z * (1.0 / 720.0 + z / 5040.0))));
}

/// Depth of a segment of length ℓ (m) along which a signed distance f (m, negative inside) changes linearly from f₀ to f₁. The
/// two-way extinction is that of VolSDF (Yariv et al. 2021), with s the sharpness (1/m):
///
///     σ(f) = s Ψ(−s f),        x = ∫ σ dt = ℓ s ⟨Ψ(−u)⟩, the mean between u₀ = s f₀ and u₁ = s f₁
///
/// in closed form at every sharpness and length: a surface inside of a long segment is neither missed nor doubled, and no
/// difference of nearly equal numbers is formed. `length_m` ≥ 0, `sharpness_per_m` > 0, all finite.
inline SurfaceDepth surface_depth(double near_m, double far_m, double length_m, double sharpness_per_m) {
  const double u0 = sharpness_per_m * near_m, u1 = sharpness_per_m * far_m, step = u1 - u0;
  double mean, by_near, by_far;  // of Ψ(−u)
  if (u0 >= 0.0 && u1 >= 0.0) {
    // From the nearer end to the surface, where the exponential does not vanish against the other.
    const double e0 = 0.5 * std::exp(-u0), e1 = 0.5 * std::exp(-u1);
    mean = step >= 0.0 ? e0 * exponential_mean(-step) : e1 * exponential_mean(step);
    by_near = step > -0.03 ? -e0 * exponential_second(-step) : (mean - e0) / step;
    by_far = step < 0.03 ? -e1 * exponential_second(step) : (e1 - mean) / step;
  } else if (u0 <= 0.0 && u1 <= 0.0) {
    const double e0 = 0.5 * std::exp(u0), e1 = 0.5 * std::exp(u1);
    const double rest = step >= 0.0 ? e1 * exponential_mean(-step) : e0 * exponential_mean(step);
    mean = 1.0 - rest;
    by_near = std::abs(step) < 0.03 ? -e0 * exponential_second(step) : (e0 - rest) / step;
    by_far = std::abs(step) < 0.03 ? -e1 * exponential_second(-step) : (rest - e1) / step;
  } else {
    // Through the surface: both parts end at Ψ = ½.
    const double outside = std::abs(u0 > 0.0 ? u0 / step : u1 / step), u_out = std::max(u0, u1), u_in = std::min(u0, u1);
    mean = outside * 0.5 * exponential_mean(-u_out) + (1.0 - outside) * (1.0 - 0.5 * exponential_mean(u_in));
    const bool apart = std::abs(step) > 1e-6;
    by_near = apart ? (mean - laplace_below(u0)) / step : -0.25;
    by_far = apart ? (laplace_below(u1) - mean) / step : -0.25;
  }
  const double scale = length_m * sharpness_per_m;
  return {scale * mean, scale * sharpness_per_m * by_near, scale * sharpness_per_m * by_far};
}

}  // namespace sarnerf
