// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "console.h"
#include "options.h"
#include "run_folder.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf::app {

/// Sets the weights smooth_* as --smoothness says: times a factor, or times the one that validation chooses. A run that is
/// there and goes on has been through that: its weights are taken. Says on the console what was chosen. Throws as
/// choose_smoothness().
TrainerOptions with_chosen_smoothness(const Options& options, const TrainerOptions& training, const TrainingSet& set,
                                      const RunFolder& folder, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
