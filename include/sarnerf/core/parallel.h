// SPDX-License-Identifier: Apache-2.0
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

/// Passed to a long computation so that its caller can follow its progress and stop it. Libraries never print:
/// the program handles the reports. Default-constructed, it neither reports nor stops.
struct Monitor {
  /// Called now and then, possibly from any thread but never from two at once.
  std::function<void(std::string_view stage, std::uint64_t done, std::uint64_t total)> progress;

  /// Set from outside (by a signal handler, for example) to end the computation at the next clean point.
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

/// Default number of threads: OMP_NUM_THREADS when it is a number above zero (or a list that begins with
/// one), else the number of processors in the affinity mask.
int default_thread_count();

/// While it exists, limits the threads of every parallel loop of the process (ours, OpenVDB's, Embree's builds:
/// all use oneTBB). One at a time, made by the program's main function. The limit is lower than requested beyond
/// 16 threads a processor, or where the system refuses to make so many; thread_count() returns the actual one.
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

/// The same outside of every parallel_for, also if it is called inside one.
int most_threads();

/// Whether the caller is inside the body of a parallel_for that runs on several threads. There a further
/// parallel_for runs serially on the caller, so that pools do not nest: a sweep that gives each worker a
/// view of its own renders that view with the same code as a single one.
bool in_parallel_region();

/// Calls body(begin, end, worker) on disjoint chunks of [0, count), at most `grain` indices each.
/// `worker` is in [0, thread_count()), and no two simultaneous calls have the same one, so it can index
/// scratch space. The first exception thrown by a body is rethrown here after the others stopped.
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end, int worker)>& body);

/// Measures wall-clock seconds since its construction.
class Stopwatch {
 public:
  double seconds() const { return seconds_between(start_, Clock::now()); }

  /// The same, and restarts the stopwatch.
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

// For functions that loop over samples: one build serves all processors, and the loader selects the clone.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SARNERF_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define SARNERF_CLONES
#endif
