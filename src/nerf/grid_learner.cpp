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

GridLearner::GridLearner(const TrainingSet& set, const GridOptions& options)
    : options_(options), field_(initial_grid_field(set, options)) {
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
  bool changed = false;
  const int level = std::min(options_.n_levels - 1,
                             static_cast<int>(progress / kRefinedBy * (options_.n_levels - 1)));
  if (level > level_) {
    for (; level_ < level; ++level_) field_ = refined(field_);
    restart_optimiser();
    neighbours_.reset();
    changed = true;
  }
  if (const int due = static_cast<int>(progress * (options_.n_prunings + 1)); due > n_prunings_ && progress >= options_.prune_from) {
    n_prunings_ = due;
    const auto rows = rows_that_see(set, field_.occupied_box_m());
    const torch::Tensor kept = prune(field_, worth_keeping(field_, set, rows, sampling, options_));
    for (auto* state : moments()) {
      state->exp_avg(state->exp_avg().index_select(0, kept));
      state->exp_avg_sq(state->exp_avg_sq().index_select(0, kept));
    }
    neighbours_.reset();
    changed = true;
  }
  return changed;
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
  add_text(archive, "learner", {{"level", level_}, {"prunings", n_prunings_}, {"adam_steps", steps}});
  return archive;
}

void GridLearner::restore(const Archive& archive, const std::string& where) {
  field_ = restore_grid_field(archive, where);
  neighbours_.reset();
  restart_optimiser();
  const Json text = text_of(archive, "learner", where);
  level_ = member<int>(text, "level", where);
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
