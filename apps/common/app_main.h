// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "console.h"
#include "exit_code.h"
#include "interrupt.h"
#include "process.h"
#include "sarnerf/core/parallel.h"
#include "shared_options.h"

namespace sarnerf::app {

/// Sets the number of threads to what can work, and warns where that is fewer than were asked for.
void take_threads(SharedOptions& options, Console& console);

/// The main() of a program: `parse` reads the command line into Options, whose member `shared` holds the SharedOptions,
/// or returns nothing when help was asked for; `run` is called with signals caught and threads limited. Returns the exit
/// code.
template <class Options>
int app_main(const char* name, int argc, char** argv, std::optional<Options> (*parse)(int, char**),
             void (*run)(const Options&, Console&)) {
  seconds_since_start();  // the clock's zero, should the system not tell
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
