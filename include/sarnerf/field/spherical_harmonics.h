// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <numbers>

namespace sarnerf {

/// Degrees 0, 1 and 2 are supported: 1, 4 and 9 harmonics.
inline constexpr int kMaxHarmonicsDegree = 2;
inline constexpr int kMaxHarmonics = 9;
constexpr int n_harmonics(int degree) { return (degree + 1) * (degree + 1); }

/// Real orthonormal spherical harmonics Y_lm of a unit vector in world axes, in the order (0,0), (1,−1),
/// (1,0), (1,1), (2,−2) … (2,2); no Condon–Shortley sign. Those beyond `degree` are left 0.
template <class T>
std::array<T, kMaxHarmonics> spherical_harmonics(const glm::vec<3, T>& d, int degree) {
  constexpr T kSqrt5 = T(2.23606797749978969640917366873127624L);
  constexpr T kZero = std::numbers::inv_sqrtpi_v<T> / 2;  // √(1/4π)
  constexpr T kOne = std::numbers::sqrt3_v<T> * kZero;    // √(3/4π)
  constexpr T kTwo = kSqrt5 * kOne;                       // √(15/4π)
  constexpr T kTwoAxial = kSqrt5 * kZero / 2;             // √(5/16π)

  std::array<T, kMaxHarmonics> y{};
  y[0] = kZero;
  if (degree >= 1) {
    y[1] = kOne * d.y;
    y[2] = kOne * d.z;
    y[3] = kOne * d.x;
  }
  if (degree >= 2) {
    y[4] = kTwo * d.x * d.y;
    y[5] = kTwo * d.y * d.z;
    y[6] = kTwoAxial * (3 * d.z * d.z - 1);
    y[7] = kTwo * d.x * d.z;
    y[8] = kTwo / 2 * (d.x * d.x - d.y * d.y);
  }
  return y;
}

}  // namespace sarnerf
