// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace sarnerf::app {

/// Options that every program has.
struct SharedOptions {
  std::filesystem::path config_file;   ///< empty: none
  int n_threads = 0;                   ///< at least 1; ThreadLimit may allow fewer
  std::uint64_t max_memory_bytes = 0;  ///< 0: not given, see MemoryLimit
  bool any_memory = false;             ///< no limit: --max-memory none
  int verbosity = 0;                   ///< −1 quiet, 1 and more verbose
};

/// Memory that a program may use: the value of --max-memory, or else the memory available at the time of the call.
struct MemoryLimit {
  std::uint64_t bytes = 0;  ///< 0: no limit
  bool asked_for = false;   ///< by --max-memory

  bool allows(std::uint64_t needed_bytes) const { return bytes == 0 || needed_bytes <= bytes; }
  /// "--max-memory allows 1 GiB": for messages.
  std::string text() const;
};
MemoryLimit memory_limit(const SharedOptions& options);

/// Bytes that could be allocated now without swapping, also within the control group of this process; 0 if the system
/// does not report them.
std::uint64_t available_memory_bytes();

/// Wall-clock seconds since the system started this process, to a hundredth of a second. They include the loading of
/// its libraries, which may take half a second. Call it first in main().
double seconds_since_start();

/// Largest resident size of this process so far.
std::uint64_t peak_memory_bytes();

/// The processor's name, as the system reports it.
std::string processor_name();

}  // namespace sarnerf::app
