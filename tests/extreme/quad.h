// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#ifdef SARNERF_QUADMATH
#include <quadmath.h>
#endif

/// A precision in which rounding can be forgotten: 34 digits with libquadmath, else 19 of long double.
namespace sarnerf::test {

#ifdef SARNERF_QUADMATH
__extension__ typedef __float128 Quad;
inline Quad quad_exp(Quad x) { return expq(x); }
inline Quad quad_expm1(Quad x) { return expm1q(x); }
inline Quad quad_tanh(Quad x) { return tanhq(x); }
inline Quad quad_sin(Quad x) { return sinq(x); }
inline Quad quad_cos(Quad x) { return cosq(x); }
inline Quad quad_acos(Quad x) { return acosq(x); }
inline Quad quad_asin(Quad x) { return asinq(x); }
inline Quad quad_sqrt(Quad x) { return sqrtq(x); }
inline Quad quad_atan2(Quad y, Quad x) { return atan2q(y, x); }
/// Relative step of central differences: truncation and rounding meet here.
inline constexpr double kDifferenceStep = 1e-10;
#else
using Quad = long double;
inline Quad quad_exp(Quad x) { return std::exp(x); }
inline Quad quad_expm1(Quad x) { return std::expm1(x); }
inline Quad quad_tanh(Quad x) { return std::tanh(x); }
inline Quad quad_sin(Quad x) { return std::sin(x); }
inline Quad quad_cos(Quad x) { return std::cos(x); }
inline Quad quad_acos(Quad x) { return std::acos(x); }
inline Quad quad_asin(Quad x) { return std::asin(x); }
inline Quad quad_sqrt(Quad x) { return std::sqrt(x); }
inline Quad quad_atan2(Quad y, Quad x) { return std::atan2(y, x); }
#endif

inline Quad quad_abs(Quad x) { return x < 0 ? -x : x; }
inline double as_double(Quad x) { return static_cast<double>(x); }

}  // namespace sarnerf::test
