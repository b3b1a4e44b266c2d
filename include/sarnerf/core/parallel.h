// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace sarnerf {

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

}  // namespace sarnerf
