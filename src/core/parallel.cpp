// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/parallel.h"

#include <sched.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <charconv>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

namespace sarnerf {
namespace {

thread_local bool inside_region = false;

/// Marks the calling thread as inside a parallel loop, also if an exception leaves it.
struct RegionGuard {
  RegionGuard() { inside_region = true; }
  ~RegionGuard() { inside_region = false; }
  RegionGuard(const RegionGuard&) = delete;
  RegionGuard& operator=(const RegionGuard&) = delete;
};

/// Threads that do nothing; all of them end in the destructor.
class IdleThreads {
 public:
  ~IdleThreads() {
    {
      const std::scoped_lock lock(mutex_);
      go_ = true;
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  /// Starts one more thread; returns whether the system made it.
  bool add() {
    try {
      threads_.emplace_back([this] {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return go_; });
      });
      return true;
    } catch (const std::system_error&) {
      return false;
    }
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool go_ = false;
  std::vector<std::thread> threads_;
};

int processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? std::max(1, CPU_COUNT(&set)) : 1;
}

/// With more threads per processor they only wait for one another.
constexpr int kMostPerProcessor = 16;

/// Number of threads, the caller included, that are useful and that the system can make. oneTBB ends the process when it gets
/// fewer than it requests, so limits on processes or address space must be detected here first. About 15 µs a thread.
int threads_to_be_had(int n_wanted) {
  const int n = std::clamp(n_wanted, 1, kMostPerProcessor * processors());
  IdleThreads others;
  int n_made = 1;
  while (n_made < n && others.add()) ++n_made;
  // Libraries may need the rest.
  return n_made == n ? n : std::max(1, n_made / 2);
}

}  // namespace

int default_thread_count() {
  if (const char* text = std::getenv("OMP_NUM_THREADS")) {
    // OpenMP allows a list; its first number is used here.
    const std::string_view first = std::string_view(text).substr(0, std::string_view(text).find(','));
    int n = 0;
    const auto [end, error] = std::from_chars(first.data(), first.data() + first.size(), n);
    if (error == std::errc() && end == first.data() + first.size() && n > 0) return n;
  }
  return processors();
}

struct ThreadLimit::State {
  explicit State(int n)
      : control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(n)) {}
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int n_threads)
    : state_(std::make_unique<State>(threads_to_be_had(n_threads))) {}
ThreadLimit::~ThreadLimit() = default;

bool in_parallel_region() { return inside_region; }

int most_threads() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

int thread_count() { return inside_region ? 1 : most_threads(); }

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
