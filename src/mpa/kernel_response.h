// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernel_math.h"
#include "sarnerf/mpa/integrator.h"

namespace sarnerf {
namespace {

/// Contribution of a segment c = source · value and its derivative by the segment's own optical depth,
/// ∂c/∂x = source · slope; the transmittance in front is part of both.
struct Response {
  double value;
  double slope;
};

/// A segment of length ℓ and optical depth x behind the optical depth τ. `kBrightness`: the source is γ
/// instead of P, x takes the place of ℓ (docs/equations.md, E1). Whatever is not asked for, the
/// compiler drops.
///
/// Differences of transmittances are taken where they do not cancel, polynomials where they would; the
/// discarded one may overflow. x² cannot: x < 10⁷⁷ for all float32 lengths and extinctions.
template <Integrator kIntegrator, bool kBrightness>
inline Response respond(double l, double x, double tau) {
  if constexpr (kIntegrator == Integrator::exact) {
    const double t_in = exp_minus(tau), t_out = exp_minus(tau + x);
    const bool thin = x < 1.0;
    if constexpr (kBrightness) {
      return {thin ? t_in * (x * mean_transmittance(x)) : t_in - t_out, t_out};
    } else {
      const double x_or_1 = thin ? 1.0 : x;
      const double thick_value = (t_in - t_out) / x_or_1;
      const double thick_slope = (t_out * (1.0 + x) - t_in) / (x_or_1 * x_or_1);
      return {l * (thin ? t_in * mean_transmittance(x) : thick_value),
              l * (thin ? t_in * mean_transmittance_slope(x) : thick_slope)};
    }
  } else if constexpr (kIntegrator == Integrator::midpoint) {
    const double t = exp_minus(tau + 0.5 * x);
    if constexpr (kBrightness) return {t * x, t * (1.0 - 0.5 * x)};
    return {t * l, t * (-0.5 * l)};
  } else if constexpr (kIntegrator == Integrator::paper) {
    const double t = exp_minus(tau + x);
    if constexpr (kBrightness) return {t * x, t * (1.0 - x)};
    return {t * l, t * -l};
  } else {
    const double t = exp_minus(tau + x), e2 = exp_minus(2.0 * x);
    const bool thin = x < 0.5;
    const double thick_tanh = (1.0 - e2) / (1.0 + e2);
    if constexpr (kBrightness) {
      const double tanh_x = thin ? x * tanh_ratio(x * x) : thick_tanh;
      return {t * tanh_x, t * (1.0 - tanh_x * tanh_x - tanh_x)};
    } else {
      const double x_or_1 = thin ? 1.0 : x;
      const double thick_ratio = thick_tanh / x_or_1;
      const double thick_slope = (1.0 - thick_tanh * thick_tanh - thick_ratio) / x_or_1;
      const double ratio = thin ? tanh_ratio(x * x) : thick_ratio;
      const double slope = thin ? x * tanh_ratio_slope(x * x) : thick_slope;
      return {l * (t * ratio), l * (t * (slope - ratio))};
    }
  }
}

}  // namespace
}  // namespace sarnerf
