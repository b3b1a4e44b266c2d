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
  std::uint64_t max_memory_bytes = 0;  ///< 0: none given, see process.h
  bool any_memory = false;             ///< whatever the machine has: --max-memory none
  int verbosity = 0;                   ///< −1 quiet, 1 and more verbose
};

/// What a program may take: what --max-memory says, or else what the machine has left when it is asked.
struct MemoryLimit {
  std::uint64_t bytes = 0;  ///< 0: none
  bool asked_for = false;   ///< by --max-memory

  bool allows(std::uint64_t needed_bytes) const { return bytes == 0 || needed_bytes <= bytes; }
  /// "--max-memory allows 1 GiB": for messages.
  std::string text() const;
};
MemoryLimit memory_limit(const SharedOptions& options);

/// Bytes that could be allocated now without swapping, in the control group of this process, too; 0 where the system does
/// not say.
std::uint64_t available_memory_bytes();

/// Wall-clock seconds since the system started this process: loading its libraries, which may take half a second,
/// counts. To a hundredth of a second. Call first thing in main().
double seconds_since_start();

/// Largest resident size of this process so far.
std::uint64_t peak_memory_bytes();

/// The processor's name, as the system has it.
std::string processor_name();

}  // namespace sarnerf::app
