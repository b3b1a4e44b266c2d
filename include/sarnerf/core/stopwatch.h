// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <utility>

namespace sarnerf {

/// Wall-clock seconds since it was made.
class Stopwatch {
 public:
  double seconds() const { return seconds_between(start_, Clock::now()); }

  /// The same, and begins anew.
  double lap() {
    const auto now = Clock::now();
    return seconds_between(std::exchange(start_, now), now);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds_between(Clock::time_point a, Clock::time_point b) {
    return std::chrono::duration<double>(b - a).count();
  }

  Clock::time_point start_ = Clock::now();
};

}  // namespace sarnerf
