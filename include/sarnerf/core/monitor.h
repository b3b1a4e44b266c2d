// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string_view>

#include "sarnerf/core/error.h"

namespace sarnerf {

/// What a long computation is given so that its caller can watch and stop it. Libraries never print:
/// the program decides what becomes of the reports. Default-constructed, it watches nothing.
struct Monitor {
  /// Called now and then, possibly from any thread but never from two at once.
  std::function<void(std::string_view stage, std::uint64_t done, std::uint64_t total)> progress;

  /// Set from elsewhere (a signal handler, say) to end the computation at the next clean point.
  const std::atomic<bool>* stop = nullptr;

  bool stop_requested() const { return stop != nullptr && stop->load(std::memory_order_relaxed); }

  /// Throws Interrupted when a stop was requested. Cheap enough for every row of an image.
  void check() const {
    if (stop_requested()) throw Interrupted();
  }
  void report(std::string_view stage, std::uint64_t done, std::uint64_t total) const {
    if (progress) progress(stage, done, total);
  }
};

}  // namespace sarnerf
