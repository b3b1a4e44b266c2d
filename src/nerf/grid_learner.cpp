// SPDX-License-Identifier: Apache-2.0
#include "grid_learner.h"

#include <algorithm>
#include <cmath>

#include "archive_text.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/returned_share.h"

namespace sarnerf {
namespace {

/// Share of the training after which all halvings are done, the first ones sooner.
constexpr double kRefinedBy = 0.25;

/// Rows that a pass looks at for voxels to give up, or up to twice as many: enough to meet each voxel from many sides.
constexpr std::size_t kRowsOfPass = 1000;

/// How often as many rows must have been learned from before the next pass: it takes half as long as learning from them
/// once, and shows little where little has been learned.
constexpr double kRowsLearned = 3.0;

/// Largest two-way depth of a voxel: more only slows down the way back.
constexpr double kMostDepth = 40.0;

}  // namespace

GridLearner::GridLearner(const TrainingSet& set, const GridOptions& options, int rows_per_step, const Monitor& monitor)
    : options_(options), rows_per_step_(rows_per_step), field_(initial_grid_field(set, options, monitor)),
      source_scale_(field_.source_scale()), adam_(field_) {
}

bool GridLearner::adapt(double progress, const TrainingSet& set, const RaySampling& sampling) {
  progress_ = progress;
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
  adam_ = VoxelAdam(field_);
  forget_layout();
}

void GridLearner::forget_layout() {
  neighbours_.reset();
  pass_.reset();
}

const RowsOfPass& GridLearner::pass(const TrainingSet& set) {
  if (!pass_) pass_ = rows_of_pass(set, field_.occupied_box_m(), kRowsOfPass);
  return *pass_;
}

int GridLearner::prunings_by(double progress) const {
  return static_cast<int>(progress * (options_.n_prunings + 1));
}

bool GridLearner::pruning_is_due(double progress, const TrainingSet& set) {
  if (progress < options_.prune_from || prunings_by(progress) <= n_prunings_) return false;
  const auto n_learned = static_cast<double>(steps_since_change_) * rows_per_step_;
  return n_learned >= kRowsLearned * static_cast<double>(pass(set).rows.size());
}

void GridLearner::give_up_voxels(const TrainingSet& set, const RaySampling& sampling) {
  steps_since_change_ = 0;
  const torch::Tensor kept = prune(field_, worth_keeping(field_, set, pass(set), sampling, options_));
  adam_.keep(kept);
  forget_layout();
}

void GridLearner::add_smoothness(std::span<const float> shares) {
  if (options_.smooth_density == 0.0 && options_.smooth_source == 0.0 && options_.smooth_angular == 0.0) return;
  if (!neighbours_) neighbours_.emplace(field_);
  const auto add = [&](torch::Tensor& parameter, std::span<const float> weights) {
    neighbours_->add_smoothness_gradient(parameter.data_ptr<float>(), weights, shares,
                                         parameter.mutable_grad().data_ptr<float>());
  };
  const auto density = static_cast<float>(options_.smooth_density);
  add(field_.log_depth, {&density, 1});
  std::vector<float> source(static_cast<std::size_t>(field_.channels().n_source()),
                            static_cast<float>(options_.smooth_angular));
  source[0] = static_cast<float>(options_.smooth_source);
  add(field_.coefficients, source);
}

std::vector<float> GridLearner::shares() const {
  const float* d = field_.log_depth.grad().data_ptr<float>();
  const float* c = field_.coefficients.grad().data_ptr<float>();
  const auto n_source = static_cast<std::size_t>(field_.channels().n_source());
  std::vector<float> shares(field_.n_active());
  for (std::size_t n = 0; n < shares.size(); ++n)
    if (d[n] != 0.0f || c[n * n_source] != 0.0f) shares[n] = 1.0f;
  return shares;
}

void GridLearner::minimise(const torch::Tensor& loss, double rate) {
  field_.set_source_scale(source_scale_);
  for (torch::Tensor& parameter : field_.parameters()) parameter.mutable_grad() = torch::Tensor();
  loss.backward();
  const std::vector<float> shares = this->shares();
  add_smoothness(shares);
  const torch::NoGradGuard no_grad;
  const double source_rate = rate * options_.source_rate;
  const double decay = options_.brightness_decay * std::pow(options_.final_brightness_decay, progress_);
  adam_.step(field_, shares, {rate * options_.density_rate, source_rate, source_rate * decay});
  field_.log_depth.clamp_max_(std::log(kMostDepth));
  ++steps_at_level_;
  ++steps_since_change_;
}

void GridLearner::finish(const TrainingSet& set) {
  field_.set_source_scale(source_scale_);
  field_.set_source_scale(source_scale_ * returned_share(field_, set));
}

Archive GridLearner::state() const {
  Archive archive = field_.state();
  adam_.save(archive);
  add_text(archive, "learner", {{"level", level_},
            {"level_progress", level_progress_},
            {"steps_at_level", steps_at_level_},
            {"steps_since_change", steps_since_change_},
            {"prunings", n_prunings_},
            {"adam_steps", adam_.steps()}});
  return archive;
}

void GridLearner::restore(const Archive& archive, const std::string& where) {
  field_ = restore_grid_field(archive, where);
  forget_layout();
  const Json text = text_of(archive, "learner", where);
  level_ = member<int>(text, "level", where);
  level_progress_ = member<double>(text, "level_progress", where);
  steps_at_level_ = member<std::int64_t>(text, "steps_at_level", where);
  steps_since_change_ = member<std::int64_t>(text, "steps_since_change", where);
  n_prunings_ = member<int>(text, "prunings", where);
  adam_ = VoxelAdam(field_);
  adam_.restore(archive, member<std::int64_t>(text, "adam_steps", where), where);
}

}  // namespace sarnerf
