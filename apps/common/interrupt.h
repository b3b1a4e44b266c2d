// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace sarnerf::app {

/// Set by the first SIGINT or SIGTERM after catch_signals(): computations stop at their next clean point
/// (Monitor::stop). The second one ends the process at once with exit code 130.
const std::atomic<bool>& stop_requested();

/// Installs the handlers, and lets a write beyond the limit on file sizes (SIGXFSZ) fail with an error
/// instead of killing the process.
void catch_signals();

}  // namespace sarnerf::app
