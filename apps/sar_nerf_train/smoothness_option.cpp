// SPDX-License-Identifier: Apache-2.0
#include "smoothness_option.h"

#include "config_text.h"
#include "sarnerf/core/format.h"
#include "sarnerf/nerf/smoothness_choice.h"

namespace sarnerf::app {
namespace {

/// Half as many steps tell which smoothness is the best.
constexpr std::int64_t kShorter = 2;

std::string text_of(const SmoothnessChoice& choice) {
  std::string text;
  for (const SmoothnessTrial& trial : choice.trials)
    text += format("%s%.6g at %.3g", text.empty() ? "" : ", ", trial.loss, trial.factor);
  return format("smoothness: %.3g times what suits as many views (loss of held-out views: %s)", choice.factor, text.c_str());
}

}  // namespace

TrainerOptions with_chosen_smoothness(const Options& o, const TrainerOptions& training, const TrainingSet& set,
                                      const RunFolder& folder, Console& console, const Monitor& monitor) {
  if (!o.smoothness.validated) return with_smoothness(training, o.smoothness.factor);
  std::error_code ignored;
  if (!o.overwrite && std::filesystem::exists(folder.config(), ignored))
    if (const auto found = smoothness_in(folder.config())) {
      TrainerOptions same = training;
      std::tie(same.grid.smooth_density, same.grid.smooth_source, same.grid.smooth_angular) = *found;
      return same;
    }
  const SmoothnessChoice choice = choose_smoothness(set, training, std::max<std::int64_t>(1, o.steps / kShorter), monitor);
  console.note(text_of(choice));
  return with_smoothness(training, choice.factor);
}

}  // namespace sarnerf::app
