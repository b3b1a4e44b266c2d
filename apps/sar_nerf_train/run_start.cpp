// SPDX-License-Identifier: Apache-2.0
#include "run_start.h"

#include "checkpoint.h"
#include "config_text.h"
#include "output_files.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/nerf/model_file.h"

namespace sarnerf::app {
namespace {

bool is_there(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

/// A model that cannot be read is made again from the checkpoint.
bool is_whole_model(const std::filesystem::path& path) {
  try {
    (void)read_model(path);
    return true;
  } catch (const CheckpointError&) {
    return false;
  }
}

[[noreturn]] void refuse(const RunFolder& folder, const std::string& why) {
  throw UsageError(folder.path().string() + ": another run is in the way (" + why +
                   "); choose another folder (-o) or allow --overwrite");
}

/// Refuses a run of other options; those that say how long it trains may be raised by --resume.
void compare(const Options& o, const RunFolder& folder, const std::string& config) {
  const std::string differs = config_difference(folder.config(), config, !o.resume);
  if (differs.empty()) return;
  if (o.resume)
    throw UsageError("--resume " + folder.path().string() +
                     ": only --steps and --time may change (" + differs +
                     "); leave other options out");
  const bool only_length = config_difference(folder.config(), config, false).empty();
  refuse(folder, differs + (only_length ? "; sar_nerf_train --resume " + folder.path().string() +
                                              " with that option goes on"
                                        : ""));
}

void require_longer(const Options& o, const RunState& state) {
  if (!o.time_s && o.steps < state.steps)
    throw UsageError("--steps " + std::to_string(o.steps) + ": the run has done " +
                     std::to_string(state.steps) + " already; ask for more");
  if (o.time_s && !state.finished && *o.time_s <= state.seconds)
    throw UsageError("--time: the run has taken " + std::to_string(state.seconds) +
                     " s already; allow more");
}

}  // namespace

void check_place(const Options& o, const RunFolder& folder) {
  if (is_there(folder.path()) && !std::filesystem::is_directory(folder.path()))
    throw UsageError(folder.path().string() +
                     ": expected a place for a folder, found a file; choose another -o");
  refuse_inside(folder.path(), std::vector{o.dataset, o.against});
  require_possible(folder.path());
  if (!folder.occupied() || o.overwrite) return;
  if (!is_there(folder.config())) refuse(folder, "files without a config.toml");
}

Start start_run(const Options& o, const RunFolder& folder, const std::string& config,
                const std::string& fingerprint, Console& console) {
  Start start;
  if (o.overwrite) folder.clear();
  if (is_there(folder.config())) {
    compare(o, folder, config);
    if (is_there(folder.checkpoint())) {
      try {
        start.checkpoint = read_archive(folder.checkpoint());
      } catch (const CheckpointError& error) {
        throw CheckpointError(std::string(error.what()) + "; the same command with --overwrite begins again");
      }
      const RunState state = run_state(*start.checkpoint, folder.checkpoint().string());
      if (state.dataset_sha256 != fingerprint)
        refuse(folder, "it was trained on other images: the dataset has changed since");
      require_longer(o, state);
      const bool same_length = config_difference(folder.config(), config, true).empty();
      start.done = state.finished && same_length && is_there(folder.report()) && is_whole_model(folder.model());
      if (start.done) return start;
      if (state.finished && same_length)
        console.note(folder.path().string() + ": trained, but its model or report is missing or damaged: they are made again");
      else
        console.note("continuing after " + counted(static_cast<std::uint64_t>(state.steps), "step"));
    } else {
      folder.clear();
    }
    folder.clear_reports();
  }
  write_file_atomically(folder.config(), config);
  return start;
}

}  // namespace sarnerf::app
