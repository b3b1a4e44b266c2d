// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "shared_options.h"

namespace sarnerf::app {

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

}  // namespace sarnerf::app
