// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/trainer.h"
#include "train/loss.h"

namespace sarnerf {

/// What a field needs beside itself while it is learned: an optimiser, priors, a way to adapt its resolution.
class FieldLearner {
 public:
  virtual ~FieldLearner() = default;

  virtual const LearnedField& field() const = 0;

  /// Refines and prunes as `progress` asks for. `epoch_steps`: steps in which each row is learned from once. True when the occupied
  /// space has changed.
  virtual bool adapt(double progress, std::int64_t epoch_steps) = 0;

  /// One step of the optimiser: carries ∂L/∂pixel of rows that field() rendered back to its parameters, adds the field's priors, and
  /// moves the parameters at `rate`, a fraction of the largest learning rates. Returns the sum of the priors.
  virtual double minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) = 0;

  /// Another texture of the ground that the field's rays end on.
  virtual void set_ground(std::shared_ptr<const LevelGround> ground) = 0;

  /// Field, optimiser and progress, for a checkpoint and back.
  virtual Archive state() const = 0;
  virtual void restore(const Archive& archive, const std::string& where) = 0;
};

/// Throws UsageError for a field that is not known.
std::unique_ptr<FieldLearner> make_learner(const TrainingSet& set, const TrainerOptions& options, const Monitor& monitor = {});

/// The learner of an MlpField.
std::unique_ptr<FieldLearner> make_mlp_learner(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed,
                                               const Monitor& monitor);

}  // namespace sarnerf
