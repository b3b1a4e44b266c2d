// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

namespace sarnerf::app {

/// Options that every program has.
struct SharedOptions {
  std::filesystem::path config_file;   ///< empty: none
  int n_threads = 0;                   ///< at least 1; ThreadLimit may allow fewer
  std::uint64_t max_memory_bytes = 0;  ///< 0: none given, see memory_limit.h
  bool any_memory = false;             ///< whatever the machine has: --max-memory none
  int verbosity = 0;                   ///< −1 quiet, 1 and more verbose
};

}  // namespace sarnerf::app
