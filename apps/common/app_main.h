// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "console.h"
#include "process.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf::app {

class Console;

/// Exit codes of all programs (docs/design.md).
enum ExitCode : int {
  kDone = 0,
  kFailure = 1,      ///< at run time: the disk is full, memory is exhausted
  kUsage = 2,        ///< contradictory options, existing output, more memory than allowed, no such view
  kBadInput = 3,
  kNumerics = 4,
  kInterrupted = 130,
};

/// Runs the body of a program. Turns what it throws into one line on the console and an exit code; no other function does.
int run_program(Console& console, const std::function<void()>& body);

/// Set by the first SIGINT or SIGTERM after catch_signals(): computations stop at their next clean point
/// (Monitor::stop). The second one ends the process at once with exit code 130.
const std::atomic<bool>& stop_requested();

/// Installs the handlers, and lets a write beyond the limit on file sizes (SIGXFSZ) fail with an error
/// instead of killing the process.
void catch_signals();

/// Sets the number of threads to the number that can run, and warns if fewer can run than were requested.
void take_threads(SharedOptions& options, Console& console);

/// The main() of a program: `parse` reads the command line into Options, whose member `shared` holds the SharedOptions,
/// or returns nothing when help was asked for; `run` is called with signals caught and threads limited. Returns the exit
/// code.
template <class Options>
int app_main(const char* name, int argc, char** argv, std::optional<Options> (*parse)(int, char**),
             void (*run)(const Options&, Console&)) {
  seconds_since_start();  // sets the clock's zero if the system does not report the start time
  Console console(name);
  return run_program(console, [&] {
    std::optional<Options> options = parse(argc, argv);
    if (!options) return;
    console.set_verbosity(options->shared.verbosity);
    catch_signals();
    const ThreadLimit threads(options->shared.n_threads);
    take_threads(options->shared, console);
    run(*options, console);
  });
}

}  // namespace sarnerf::app
