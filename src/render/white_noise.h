// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>

#include "sarnerf/core/units.h"

namespace sarnerf {

/// Random numbers by position instead of by turn: a pixel's value depends on its indices and the key
/// alone, so that rows can be made by any thread and empty pixels skipped. SplitMix64's finaliser
/// (Steele, Lea and Flood 2014) over a counter.
class WhiteNoise {
 public:
  explicit WhiteNoise(std::uint64_t seed) : key_(mix(seed)) {}

  /// An independent stream for each value.
  WhiteNoise stream(std::uint64_t value) const { return WhiteNoise(key_ ^ mix(value + kStep)); }
  WhiteNoise stream(double value) const { return stream(std::bit_cast<std::uint64_t>(value + 0.0)); }

  /// Complex circular Gaussian of mean 0 and unit variance, E|w|² = 1. By Box and Muller: |w|² is
  /// exponential and the phase uniform.
  std::complex<double> complex_gaussian(std::uint64_t index) const {
    const double power = -std::log(uniform(2 * index));
    return std::polar(std::sqrt(power), 2.0 * kPi * uniform(2 * index + 1));
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ull;

  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  /// In (0, 1): never zero, whose logarithm is infinite.
  double uniform(std::uint64_t index) const {
    return (double(mix(key_ + (index + 1) * kStep) >> 11) + 0.5) * 0x1p-53;
  }

  std::uint64_t key_;
};

}  // namespace sarnerf
