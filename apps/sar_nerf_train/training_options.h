// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "options.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf::app {

/// The training options that suit the images, changed as --option says. Throws UsageError for unknown names, with the
/// closest one, for values of another type, and for those with which nothing can be learned or no memory suffices.
TrainerOptions training_options(const Options& options, const TrainingSet& set);

}  // namespace sarnerf::app
