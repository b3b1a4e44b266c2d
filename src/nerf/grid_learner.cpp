// SPDX-License-Identifier: Apache-2.0
#include "grid_learner.h"

#include <algorithm>
#include <cmath>

#include "archive_text.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Share of the training after which all halvings are done, the first ones sooner.
constexpr double kRefinedBy = 0.25;

/// How often each row must have been learned from before a pass over all of them looks for voxels to give up: the pass
/// takes as long as learning from them once, and shows little where little has been learned.
constexpr double kRowsLearned = 3.0;

/// Largest two-way depth of a voxel: more only slows down the way back.
constexpr double kMostDepth = 40.0;

torch::optim::OptimizerParamGroup group(const torch::Tensor& parameter, double rate) {
  // Second moments are remembered for a hundred steps: rows are few, and what they show differs. No epsilon to speak
  // of: gradients of squares relative to the peak are small numbers.
  auto options = torch::optim::AdamOptions(rate).betas({0.9, 0.99}).eps(1e-15);
  return {{parameter}, std::make_unique<torch::optim::AdamOptions>(options)};
}

void require(bool fits, const std::string& where, const char* what) {
  if (!fits) throw CheckpointError(where + ": " + what + " do not belong together; the file is damaged");
}

}  // namespace

GridLearner::GridLearner(const TrainingSet& set, const GridOptions& options, int rows_per_step)
    : options_(options), rows_per_step_(rows_per_step), field_(initial_grid_field(set, options)) {
  restart_optimiser();
}

void GridLearner::restart_optimiser() {
  adam_ = std::make_unique<torch::optim::Adam>(std::vector<torch::optim::OptimizerParamGroup>{
      group(field_.log_depth, options_.density_rate), group(field_.coefficients, options_.source_rate)});
}

std::vector<torch::optim::AdamParamState*> GridLearner::moments() {
  // LibTorch's keys differ between versions; the numbers of dimensions tell the two parameters apart in all.
  std::vector<torch::optim::AdamParamState*> states(adam_->state().empty() ? 0 : 2);
  for (auto& entry : adam_->state()) {
    auto& state = static_cast<torch::optim::AdamParamState&>(*entry.second);
    states[state.exp_avg().dim() == 1 ? 0 : 1] = &state;
  }
  return states;
}

bool GridLearner::adapt(double progress, const TrainingSet& set, const RaySampling& sampling) {
  if (steps_at_level_ == 0) level_progress_ = progress;
  const bool refines = refinement_is_due(progress);
  if (refines) refine(progress);
  const bool prunes = pruning_is_due(progress, set);
  if (prunes) {
    n_prunings_ = prunings_by(progress);
    give_up_voxels(set, sampling);
  }
  return refines || prunes;
}

bool GridLearner::refinement_is_due(double progress) const {
  if (level_ + 1 >= options_.n_levels || steps_at_level_ < std::max(1, options_.level_steps)) return false;
  if (progress / kRefinedBy * (options_.n_levels - 1) < level_ + 1) return false;
  // At the pace of this level; by the clock, finer voxels will have less.
  const double step = (progress - level_progress_) / static_cast<double>(steps_at_level_);
  return 1.0 - progress >= options_.refine_steps_left * step;
}

void GridLearner::refine(double progress) {
  field_ = refined(field_);
  ++level_;
  level_progress_ = progress;
  steps_at_level_ = 0;
  steps_since_change_ = 0;
  restart_optimiser();
  neighbours_.reset();
}

int GridLearner::prunings_by(double progress) const {
  return static_cast<int>(progress * (options_.n_prunings + 1));
}

bool GridLearner::pruning_is_due(double progress, const TrainingSet& set) const {
  if (progress < options_.prune_from || prunings_by(progress) <= n_prunings_) return false;
  const auto rows = static_cast<double>(rows_that_see(set, field_.occupied_box_m()).size());
  return static_cast<double>(steps_since_change_) * rows_per_step_ >= kRowsLearned * rows;
}

void GridLearner::give_up_voxels(const TrainingSet& set, const RaySampling& sampling) {
  steps_since_change_ = 0;
  const auto rows = rows_that_see(set, field_.occupied_box_m());
  const torch::Tensor kept = prune(field_, worth_keeping(field_, set, rows, sampling, options_));
  for (auto* state : moments()) {
    state->exp_avg(state->exp_avg().index_select(0, kept));
    state->exp_avg_sq(state->exp_avg_sq().index_select(0, kept));
  }
  neighbours_.reset();
}

void GridLearner::add_smoothness() {
  if (options_.smooth_density == 0.0 && options_.smooth_source == 0.0 && options_.smooth_angular == 0.0) return;
  if (!neighbours_) neighbours_.emplace(field_);
  const auto add = [&](torch::Tensor& parameter, std::span<const float> weights) {
    neighbours_->add_smoothness_gradient(parameter.data_ptr<float>(), weights,
                                         parameter.mutable_grad().data_ptr<float>());
  };
  const auto density = static_cast<float>(options_.smooth_density);
  add(field_.log_depth, {&density, 1});
  std::vector<float> source(static_cast<std::size_t>(field_.channels().n_source()),
                            static_cast<float>(options_.smooth_angular));
  source[0] = static_cast<float>(options_.smooth_source);
  add(field_.coefficients, source);
}

void GridLearner::minimise(const torch::Tensor& loss, double rate) {
  const double largest[] = {options_.density_rate, options_.source_rate};
  for (std::size_t g = 0; g < 2; ++g)
    static_cast<torch::optim::AdamOptions&>(adam_->param_groups()[g].options()).lr(rate * largest[g]);
  adam_->zero_grad();
  loss.backward();
  add_smoothness();
  adam_->step();
  torch::NoGradGuard no_grad;
  field_.log_depth.clamp_max_(std::log(kMostDepth));
  ++steps_at_level_;
  ++steps_since_change_;
}

Archive GridLearner::state() const {
  Archive archive = field_.state();
  auto& self = const_cast<GridLearner&>(*this);
  const auto states = self.moments();
  std::vector<std::int64_t> steps;
  for (std::size_t n = 0; n < states.size(); ++n) {
    const std::string name = n == 0 ? "density" : "source";
    archive.tensors["adam_mean_" + name] = states[n]->exp_avg().clone();
    archive.tensors["adam_square_" + name] = states[n]->exp_avg_sq().clone();
    steps.push_back(states[n]->step());
  }
  add_text(archive, "learner", {{"level", level_},
            {"level_progress", level_progress_},
            {"steps_at_level", steps_at_level_},
            {"steps_since_change", steps_since_change_},
            {"prunings", n_prunings_},
            {"adam_steps", steps}});
  return archive;
}

void GridLearner::restore(const Archive& archive, const std::string& where) {
  field_ = restore_grid_field(archive, where);
  neighbours_.reset();
  restart_optimiser();
  const Json text = text_of(archive, "learner", where);
  level_ = member<int>(text, "level", where);
  level_progress_ = member<double>(text, "level_progress", where);
  steps_at_level_ = member<std::int64_t>(text, "steps_at_level", where);
  steps_since_change_ = member<std::int64_t>(text, "steps_since_change", where);
  n_prunings_ = member<int>(text, "prunings", where);
  const auto steps = member<std::vector<std::int64_t>>(text, "adam_steps", where);
  if (steps.empty()) return;
  require(steps.size() == 2, where, "the optimiser's steps");
  // One step with gradients of 0 makes LibTorch build the state that is then filled.
  for (torch::Tensor& parameter : field_.parameters()) parameter.mutable_grad() = torch::zeros_like(parameter);
  adam_->step();
  const auto states = moments();
  for (std::size_t n = 0; n < 2; ++n) {
    const std::string name = n == 0 ? "density" : "source";
    const auto dimensions = static_cast<std::int64_t>(n) + 1;
    const auto take = [&](const char* kind) {
      const torch::Tensor t = archive.tensor(kind + name, torch::kFloat, dimensions, where).clone();
      require(t.sizes() == states[n]->exp_avg().sizes(), where, "the field and its optimiser");
      return t;
    };
    states[n]->exp_avg(take("adam_mean_"));
    states[n]->exp_avg_sq(take("adam_square_"));
    states[n]->step(steps[n]);
  }
}

}  // namespace sarnerf
