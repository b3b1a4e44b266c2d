// SPDX-License-Identifier: Apache-2.0
#include "field_learner.h"

#include "grid_learner.h"
#include "mlp_learner.h"
#include "sarnerf/core/error.h"

namespace sarnerf {

std::unique_ptr<FieldLearner> make_learner(const TrainingSet& set, const TrainerOptions& options, const Monitor& monitor) {
  if (options.field == "grid")
    return std::make_unique<GridLearner>(set, options.grid, options.rows_per_step, monitor);
  if (options.field == "mlp") return std::make_unique<MlpLearner>(set, options.mlp, options.seed, monitor);
  throw UsageError("there is no field '" + options.field + "'; there are: grid, mlp");
}

}  // namespace sarnerf
