// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/trainer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/text.h"
#include "sarnerf/nerf/learned_field.h"

namespace sarnerf {

namespace {

double psnr_of_views(const LearnedField& field, const TrainingSet& set, std::span<const std::size_t> views) {
  double sum_db = 0.0;
  for (const std::size_t v : views) {
    const PosedImage& truth = set.images[v];
    sum_db += capped_psnr_db(render_view(field, truth.acquisition), truth.power, double{set.peak});
  }
  return sum_db / static_cast<double>(views.size());
}

FieldTrial trial_of(const std::string& field, const TrainingSet& set, const TrainingSet& rest, std::span<const std::size_t> held_out,
                    std::uint64_t seed, const Monitor& monitor, const TrialRule& rule) {
  const Stopwatch clock;
  FieldTrial trial;
  trial.field = field;
  TrainerOptions options = default_options(rest, field);
  options.seed = seed;
  try {
    Trainer trainer(rest, options, monitor);
    const Stopwatch learning;
    for (double progress = 0.0; progress < 1.0;) {
      monitor.check();
      trainer.step(progress);
      const std::int64_t n = trainer.steps_done();
      progress = std::max(static_cast<double>(n) / static_cast<double>(rule.n_steps), learning.seconds() / rule.most_seconds);
      monitor.report("trial of " + field, static_cast<std::uint64_t>(n), static_cast<std::uint64_t>(rule.n_steps));
    }
    trial.n_steps = trainer.steps_done();
    if (trainer.field().occupied_box_m().empty())
      trial.failure = "nothing was learned";
    else
      trial.psnr_power_db = psnr_of_views(trainer.field(), set, held_out);
    if (std::isnan(trial.psnr_power_db)) trial.failure = "its views are no numbers";
  } catch (const NumericsError& error) {
    trial.failure = error.what();
  }
  if (!trial.failure.empty()) trial.psnr_power_db = -std::numeric_limits<double>::infinity();
  trial.seconds = clock.seconds();
  return trial;
}

std::string score_text(const FieldTrial& trial) {
  return trial.failure.empty() ? format("%.2f dB", trial.psnr_power_db) : trial.failure;
}

}  // namespace

FieldChoice choose_field(const TrainingSet& set, std::uint64_t seed, const Monitor& monitor, const TrialRule& rule) {
  FieldChoice choice;
  choice.field = rule.fields.front();
  if (set.images.size() < std::max(rule.least_views, rule.n_held_out + 1)) return choice;
  choice.held_out = spread_indices(set.images.size(), rule.n_held_out);
  const TrainingSet rest = without_views(set, choice.held_out);
  for (const std::string& field : rule.fields)
    choice.trials.push_back(trial_of(field, set, rest, choice.held_out, seed, monitor, rule));
  choice.field = std::max_element(choice.trials.begin(), choice.trials.end(), [](const FieldTrial& a, const FieldTrial& b) {
                   return a.psnr_power_db < b.psnr_power_db;
                 })->field;
  return choice;
}

std::string choice_text(const FieldChoice& choice, const TrialRule& rule) {
  if (choice.trials.empty()) return choice.field + ": fewer than " + counted(rule.least_views, "view") + ", too few for a trial";
  std::string chosen, others;
  long long n_steps = 0;
  for (const FieldTrial& trial : choice.trials) {
    if (trial.field == choice.field)
      chosen = score_text(trial), n_steps = trial.n_steps;
    else
      others += (others.empty() ? "" : ", ") + trial.field + ": " + score_text(trial);
  }
  return choice.field + ": " + chosen + format(" on %zu views held out from a trial of %lld steps", choice.held_out.size(), n_steps) + " (" +
         others + ")";
}

}  // namespace sarnerf
