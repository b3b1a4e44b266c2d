// SPDX-License-Identifier: Apache-2.0
// For loops over samples: one build serves all processors, and the loader picks the clone.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <utility>

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

/// Threads to use unless told otherwise: OMP_NUM_THREADS when it is a number above zero (or begins a list with
/// one), else the processors of the affinity mask.
int default_thread_count();

/// Caps every parallel loop of the process (ours, OpenVDB's, Embree's builds: all share oneTBB)
/// while it lives. One at a time, made by the program's main function. The cap is lower than asked for, and
/// thread_count() says so, beyond 16 threads a processor or where the system refuses to make so many.
class ThreadLimit {
 public:
  explicit ThreadLimit(int n_threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Number of workers that parallel_for may use at present: 1 inside the body of another one.
int thread_count();

/// Whether the caller is inside the body of a parallel_for that shares its work between threads. There
/// a further parallel_for runs serially on the caller, so that pools do not nest: a sweep that gives
/// each worker a view of its own renders that view with the same code as a single one.
bool in_parallel_region();

/// Calls body(begin, end, worker) on disjoint chunks of [0, count), at most `grain` indices each.
/// `worker` is in [0, thread_count()) and no two calls under way at once share it, so it can index
/// scratch space. The first exception thrown by a body is rethrown here after the others stopped.
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end, int worker)>& body);

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

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SARNERF_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SARNERF_CLONES
#endif
