// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace sarnerf::app {

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Wall-clock seconds of the stages that come before rendering.
struct PreparationTimes {
  double load_s = 0.0;
  double build_s = 0.0;
  double plan_s = 0.0;
};

}  // namespace sarnerf::app
