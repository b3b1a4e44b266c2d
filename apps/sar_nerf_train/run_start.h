// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "console.h"
#include "options.h"
#include "run_folder.h"
#include "sarnerf/nerf/archive.h"

namespace sarnerf::app {

/// Before anything is read: throws UsageError where no run can be written or other files are in the way.
void check_place(const Options& options, const RunFolder& folder);

/// What is there of a run.
struct Start {
  std::optional<Archive> checkpoint;  ///< to go on from
  bool done = false;                  ///< all is there: nothing to do
};

/// Compares what is there with the wanted configuration, clears what --overwrite replaces, and writes config.toml. Call with
/// the folder locked. Throws UsageError for a run of other options or data, InputError and CheckpointError for damaged
/// files of a run.
Start start_run(const Options& options, const RunFolder& folder, const std::string& config,
                const std::string& fingerprint, Console& console);

}  // namespace sarnerf::app
