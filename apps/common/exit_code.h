// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace sarnerf::app {

class Console;

/// What every program returns to its caller (docs/design.md).
enum ExitCode : int {
  kDone = 0,
  kFailure = 1,      ///< at run time: a full disk, no memory left
  kUsage = 2,        ///< options contradict, output exists, more memory than allowed, no such view
  kBadInput = 3,
  kNumerics = 4,
  kInterrupted = 130,
};

/// Runs the body of a program and turns what it throws into one line on the console and an exit code:
/// the only place that does.
int run_program(Console& console, const std::function<void()>& body);

}  // namespace sarnerf::app
