// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/parallel.h"

#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdlib>
#include <string>

namespace sarnerf {
namespace {

thread_local bool inside_region = false;

/// Marks the calling thread as working for a parallel loop, exceptions or not.
struct RegionGuard {
  RegionGuard() { inside_region = true; }
  ~RegionGuard() { inside_region = false; }
  RegionGuard(const RegionGuard&) = delete;
  RegionGuard& operator=(const RegionGuard&) = delete;
};

}  // namespace

int default_thread_count() {
  if (const char* text = std::getenv("OMP_NUM_THREADS")) {
    char* end = nullptr;
    const long n = std::strtol(text, &end, 10);
    if (end != text && n > 0 && n < 65536) return static_cast<int>(n);
  }
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return 1;
}

struct ThreadLimit::State {
  explicit State(int n)
      : control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(n)) {}
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int n_threads)
    : state_(std::make_unique<State>(std::max(1, n_threads))) {}
ThreadLimit::~ThreadLimit() = default;

bool in_parallel_region() { return inside_region; }

int thread_count() {
  if (inside_region) return 1;
  const auto limit =
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return static_cast<int>(limit);
}

void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t, int)>& body) {
  if (count == 0) return;
  const int workers = thread_count();
  const std::size_t chunk = std::max<std::size_t>(1, grain);
  if (workers == 1 || count <= chunk) {
    for (std::size_t begin = 0; begin < count; begin += chunk) {
      body(begin, std::min(count, begin + chunk), 0);
    }
    return;
  }
  // An arena of exactly `workers` slots makes the slot index a valid scratch index.
  tbb::task_arena arena(workers);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, chunk),
        [&](const tbb::blocked_range<std::size_t>& range) {
          const RegionGuard guard;
          body(range.begin(), range.end(), tbb::this_task_arena::current_thread_index());
        },
        tbb::simple_partitioner());
  });
}

}  // namespace sarnerf
