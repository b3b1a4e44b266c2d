// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <ctime>

namespace sarnerf::bench {

/// Wall-clock and processor seconds of a run, standing still while it is being scored.
class WorkClock {
 public:
  /// Begins as if it had run for `seconds` already, of which the processor worked `cpu_seconds`.
  WorkClock(double seconds, double cpu_seconds)
      : wall_s_(seconds), cpu_s_(cpu_seconds), wall_(now_s()), cpu_(now_cpu_s()) {}

  double seconds() const { return running_ ? wall_s_ + now_s() - wall_ : wall_s_; }
  double cpu_seconds() const { return running_ ? cpu_s_ + now_cpu_s() - cpu_ : cpu_s_; }

  void stop() {
    wall_s_ = seconds();
    cpu_s_ = cpu_seconds();
    running_ = false;
  }
  void go_on() {
    wall_ = now_s();
    cpu_ = now_cpu_s();
    running_ = true;
  }

  static double now_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  }
  static double now_cpu_s() {
    timespec now = {};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

 private:
  double wall_s_, cpu_s_, wall_, cpu_;
  bool running_ = true;
};

}  // namespace sarnerf::bench
