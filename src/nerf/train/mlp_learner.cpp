// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <torch/csrc/autograd/autograd.h>
#include <torch/optim/adam.h>

#include "files/archives.h"
#include "sarnerf/core/error.h"
#include "train/field_learner.h"

namespace sarnerf {

namespace {

/// Learns an MlpField: Adam over all weights, and a refresh of the occupied voxels every refresh_steps steps.
class MlpLearner : public FieldLearner {
 public:
  MlpLearner(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed, const Monitor& monitor);

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, std::int64_t epoch_steps) override;
  void minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) override;
  void set_ground(std::shared_ptr<const LevelGround> ground) override { field_.ground = std::move(ground); }
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  void restart_optimiser();
  torch::optim::AdamParamState* moments() const;  ///< null before the first step

  MlpOptions options_;
  MlpField field_;
  std::unique_ptr<torch::optim::Adam> adam_;
  std::int64_t steps_since_refresh_ = 0;
};

MlpLearner::MlpLearner(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed, const Monitor& monitor)
    : options_(options), field_(initial_mlp_field(set, options, seed, monitor)) {
  restart_optimiser();
}

void MlpLearner::restart_optimiser() {
  // Epsilon is negligible, since gradients are small.
  adam_ = std::make_unique<torch::optim::Adam>(
      field_.parameters(), torch::optim::AdamOptions(options_.rate).betas({0.9, 0.99}).eps(1e-15));
}

torch::optim::AdamParamState* MlpLearner::moments() const {
  if (adam_->state().empty()) return nullptr;
  return static_cast<torch::optim::AdamParamState*>(adam_->state().begin()->second.get());
}

bool MlpLearner::adapt(double, std::int64_t) {
  if (options_.literal) return false;
  if (steps_since_refresh_ < options_.refresh_steps) return false;
  steps_since_refresh_ = 0;
  const Box before = field_.occupied_box_m();
  field_.refresh(options_.prune_depth);
  if (field_.cache().n_occupied() == 0 && field_.cache().n_voxels() > 0)
    throw NumericsError(
        "training diverges: the network's extinction is 0 everywhere (dead ReLU), so there is no gradient; use a lower rate");
  const Box after = field_.occupied_box_m();
  return before.min != after.min || before.max != after.max;
}

void MlpLearner::minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) {
  // Adam's first steps move all weights by the full rate, whatever their gradients. That can push the ReLU's argument
  // below 0 everywhere; the density then has no gradient and stays 0.
  const auto* const state = moments();
  const auto steps = static_cast<double>(state ? state->step() : 0);
  const double warm = std::min(1.0, (steps + 1.0) / options_.warm_up_steps);
  static_cast<torch::optim::AdamOptions&>(adam_->param_groups()[0].options())
      .lr(warm * rate * options_.rate);
  adam_->zero_grad();
  torch::autograd::backward({pixels}, {gradient});
  if (options_.literal) clear_identity(options_.shape, field_.parameters()[0].grad());
  adam_->step();
  ++steps_since_refresh_;
}

Archive MlpLearner::state() const {
  Archive archive = field_.state();
  std::int64_t steps = 0;
  if (const auto* state = moments()) {
    archive.tensors["adam_mean"] = state->exp_avg().clone();
    archive.tensors["adam_square"] = state->exp_avg_sq().clone();
    steps = state->step();
  }
  add_text(archive, "learner",
           {{"steps_since_refresh", steps_since_refresh_}, {"adam_steps", steps}});
  return archive;
}

void MlpLearner::restore(const Archive& archive, const std::string& where) {
  field_ = restore_mlp_field(archive, where);
  restart_optimiser();
  const Json text = text_of(archive, "learner", where);
  steps_since_refresh_ = member<std::int64_t>(text, "steps_since_refresh", where);
  const auto steps = member<std::int64_t>(text, "adam_steps", where);
  if (steps == 0) return;
  // One step with gradients of 0 makes LibTorch allocate the state, which is then filled.
  field_.parameters()[0].mutable_grad() = torch::zeros_like(field_.parameters()[0]);
  adam_->step();
  auto* const state = moments();
  const auto take = [&](const char* name) {
    const torch::Tensor t = archive.tensor(name, torch::kFloat, 1, where).clone();
    if (t.sizes() != state->exp_avg().sizes())
      throw CheckpointError(
          where + ": the field and its optimiser do not belong together; the file is damaged");
    return t;
  };
  state->exp_avg(take("adam_mean"));
  state->exp_avg_sq(take("adam_square"));
  state->step(steps);
}

}  // namespace

std::unique_ptr<FieldLearner> make_mlp_learner(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed,
                                               const Monitor& monitor) {
  return std::make_unique<MlpLearner>(set, options, seed, monitor);
}

}  // namespace sarnerf
