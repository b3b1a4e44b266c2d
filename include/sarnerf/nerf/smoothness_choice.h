// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/nerf/trainer.h"

namespace sarnerf {

/// A smoothness that was tried.
struct SmoothnessTrial {
  double factor = 1.0;  ///< over the weights smooth_* of the options
  double loss = 0.0;    ///< of held-out views: the less, the better
};

struct SmoothnessChoice {
  double factor = 1.0;
  std::vector<SmoothnessTrial> trials;  ///< in the order of their factors
};

/// The options with their weights smooth_* times a factor.
TrainerOptions with_smoothness(TrainerOptions options, double factor);

/// Chooses the smoothness of the field `grid` by validation: fields are learned in `n_steps` steps from five sixths of the
/// views, with the weights smooth_* times ⅓, 1 and 3, and on, as long as the outermost is the best, to 1/27 and 27. The sixth
/// that was held out judges. Where images show a level ground with speckle, by the mean deviance of the gamma likelihood,
///
///     (I + f) / (μ + f) − 1 − ln (I + f) / (μ + f),     f = speckle_floor × the ground's brightness,
///
/// whose expectation is least at the mean of I; else by the mean square error over the peak's square. All judge all pixels.
///
/// The same choice for the same set, options and number of threads. Cost: three to seven trainings. Throws UsageError for
/// fewer than 6 views and for another field, Interrupted when the monitor asks for it.
SmoothnessChoice choose_smoothness(const TrainingSet& set, const TrainerOptions& options, std::int64_t n_steps,
                                   const Monitor& monitor = {});

}  // namespace sarnerf
