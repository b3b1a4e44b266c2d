// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace sarnerf::app {

/// Wall-clock seconds since the system started this process: loading its libraries, which may take half a second,
/// counts. To a hundredth of a second. Call first thing in main().
double seconds_since_start();

/// Largest resident size of this process so far.
std::uint64_t peak_memory_bytes();

/// The processor's name, as the system has it.
std::string processor_name();

}  // namespace sarnerf::app
