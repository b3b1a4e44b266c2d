// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "sarnerf/nerf/trainer.h"

namespace sarnerf::app {

/// What a checkpoint knows beside the trainer's state.
struct RunState {
  std::string dataset_sha256;
  double progress = 0.0;  ///< largest that a step was given
  double seconds = 0.0;   ///< of all programs that worked on the run, start-up included
  double trained_s = 0.0;  ///< the same without their start-ups
  bool finished = false;
  double time_s = 0.0;  ///< that --time gave; 0: none
  std::int64_t steps = 0;
};

/// A checkpoint in memory; later steps do not change it.
Archive checkpoint_of(const Trainer& trainer, const RunState& state);

/// What the program itself needs of a checkpoint. Throws CheckpointError for another kind of file, a newer version and
/// damaged contents.
RunState run_state(const Archive& archive, const std::string& where);

/// Whether every number of an archive is finite.
bool all_finite(const Archive& archive);

}  // namespace sarnerf::app
