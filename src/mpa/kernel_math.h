// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

/// Elementary functions of the kernels. Free of branches and of calls, so that the loops around them
/// are vectorised; in double, so that neither overflow nor cancellation needs thought; with polynomials
/// only as long as float32 results need: each is a minimax fit whose relative error is stated, a
/// hundredth to a tenth of a float32 rounding. Internal linkage: see kernel.h.
namespace sarnerf {
namespace {

/// Optical depth at which a transmittance is 0: the largest product P ℓ of float32 numbers, 1.2e77, times e^−266
/// is below the smallest normal one. No product on the way there is denormal in double, which would be slow.
constexpr double kOpaqueDepth = 266.0;

/// e^−x for x ≥ 0, relative error 2.0e-9; exactly 1 at 0, exactly 0 from kOpaqueDepth on.
inline double exp_minus(double x) {
  // Adding 1.5 · 2⁵² rounds to an integer, which then stands in the low bits.
  constexpr double kRound = 0x1.8p52;
  constexpr double kLog2OfE = 1.4426950408889634;
  constexpr double kLnOf2 = 0.6931471805599453;
  const double bounded = x < kOpaqueDepth ? x : kOpaqueDepth;
  const double shifted = kRound - bounded * kLog2OfE;
  const double n = shifted - kRound;
  const double r = -bounded - n * kLnOf2;  // |r| ≤ ln(2)/2
  double p = 0.0013843641977724286;
  p = p * r + 0.0083741632754035379;
  p = p * r + 0.04166800261343754;
  p = p * r + 0.16666431171668285;
  p = p * r + 0.4999999420539519;
  p = p * r + 1.0000000321832574;
  p = p * r + 1.0;
  const std::int64_t exponent = (__builtin_bit_cast(std::int64_t, shifted) + 1023) << 52;
  const double result = p * __builtin_bit_cast(double, exponent);
  return x < kOpaqueDepth ? result : 0.0;
}

/// (1 − e^−x)/x for 0 ≤ x ≤ 1, relative error 2.7e-9; exactly 1 at 0.
inline double mean_transmittance(double x) {
  double p = 0.00012913100082119869;
  p = p * x - 0.0013011266983935751;
  p = p * x + 0.0082762089649687648;
  p = p * x - 0.041647468411462333;
  p = p * x + 0.16666365623896958;
  p = p * x - 0.4999998405556977;
  return p * x + 1.0;
}

/// Derivative of (1 − e^−x)/x for 0 ≤ x ≤ 1, relative error 5.2e-9.
inline double mean_transmittance_slope(double x) {
  double p = -0.00011189153672002885;
  p = p * x + 0.0011118450166727378;
  p = p * x - 0.0068928576864700868;
  p = p * x + 0.033315819596103072;
  p = p * x - 0.12499721788477114;
  p = p * x + 0.33333318345925889;
  return p * x - 0.5;
}

/// tanh(x)/x for 0 ≤ x ≤ 1/2 as a function of x², relative error 3.5e-10.
inline double tanh_ratio(double x_squared) {
  double p = -0.0066474883300747703;
  p = p * x_squared + 0.021297991570912092;
  p = p * x_squared - 0.053899190626084191;
  p = p * x_squared + 0.13332964257415106;
  p = p * x_squared - 0.33333326882077507;
  return p * x_squared + 1.0;
}

/// (d/dx tanh(x)/x)/x for 0 ≤ x ≤ 1/2 as a function of x², relative error 3.1e-9.
inline double tanh_ratio_slope(double x_squared) {
  double p = 0.030793770101420079;
  p = p * x_squared - 0.085470036902777241;
  p = p * x_squared + 0.17457306777009989;
  p = p * x_squared - 0.32378894945590365;
  p = p * x_squared + 0.53333297026844658;
  return p * x_squared - 0.66666666666666667;
}

}  // namespace
}  // namespace sarnerf
