// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/parallel.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "catch.h"

using namespace sarnerf;

TEST_CASE("every index is visited once, in chunks no larger than the grain") {
  for (const int n_threads : {1, 2, 5}) {
    const ThreadLimit limit(n_threads);
    CHECK(thread_count() == n_threads);
    CHECK(most_threads() == n_threads);
    std::vector<int> visits(1003);
    std::atomic<bool> chunks_fit = true, workers_fit = true;
    parallel_for(visits.size(), 7, [&](std::size_t begin, std::size_t end, int worker) {
      if (end - begin > 7) chunks_fit = false;
      if (worker < 0 || worker >= n_threads) workers_fit = false;
      for (std::size_t n = begin; n < end; ++n) ++visits[n];
    });
    CHECK(std::all_of(visits.begin(), visits.end(), [](int n) { return n == 1; }));
    CHECK(chunks_fit);
    CHECK(workers_fit);
  }
}

TEST_CASE("no two calls under way share a worker") {
  const ThreadLimit limit(4);
  std::vector<std::atomic<int>> users(4);
  std::atomic<bool> shared = false;
  parallel_for(200, 1, [&](std::size_t, std::size_t, int worker) {
    if (++users[static_cast<std::size_t>(worker)] != 1) shared = true;
    std::this_thread::yield();
    --users[static_cast<std::size_t>(worker)];
  });
  CHECK_FALSE(shared);
}

TEST_CASE("the first exception reaches the caller") {
  for (const int n_threads : {1, 3}) {
    const ThreadLimit limit(n_threads);
    CHECK_THROWS_AS(parallel_for(100, 1,
                                 [](std::size_t begin, std::size_t, int) {
                                   if (begin == 13) throw std::runtime_error("thirteen");
                                 }),
                    std::runtime_error);
    CHECK_FALSE(in_parallel_region());
  }
}

TEST_CASE("a loop inside a loop runs on its caller alone") {
  const ThreadLimit limit(3);
  std::mutex mutex;
  int n_inner = 0;
  bool stayed = true, counted_one = true;
  parallel_for(8, 1, [&](std::size_t, std::size_t, int) {
    const std::thread::id outer = std::this_thread::get_id();
    const bool one = in_parallel_region() && thread_count() == 1 && most_threads() == 3;
    parallel_for(50, 1, [&](std::size_t, std::size_t, int worker) {
      const std::scoped_lock lock(mutex);
      ++n_inner;
      stayed = stayed && worker == 0 && std::this_thread::get_id() == outer;
    });
    const std::scoped_lock lock(mutex);
    counted_one = counted_one && one;
  });
  CHECK(n_inner == 400);
  CHECK(stayed);
  CHECK(counted_one);
  CHECK_FALSE(in_parallel_region());
  CHECK(thread_count() == 3);
}
