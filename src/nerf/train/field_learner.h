// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/trainer.h"
#include "train/loss.h"

namespace sarnerf {

/// Trains a field: optimiser and adaptation of the resolution.
class FieldLearner {
 public:
  virtual ~FieldLearner() = default;

  virtual const LearnedField& field() const = 0;

  /// Refines and prunes if that is due at `progress`. `epoch_steps`: steps in which each row is used once. Returns whether the
  /// occupied space has changed.
  virtual bool adapt(double progress, std::int64_t epoch_steps) = 0;

  /// One step of the optimiser: backpropagates ∂L/∂pixel of rows that field() rendered to its parameters, and
  /// updates these at `rate`, a fraction of the largest learning rates.
  virtual void minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) = 0;

  /// Replaces the ground on which the field's rays end.
  virtual void set_ground(std::shared_ptr<const LevelGround> ground) = 0;

  /// Field, optimiser and progress, for a checkpoint and back.
  virtual Archive state() const = 0;
  virtual void restore(const Archive& archive, const std::string& where) = 0;
};

/// Throws UsageError for an unknown field.
std::unique_ptr<FieldLearner> make_learner(const TrainingSet& set, const TrainerOptions& options, const Monitor& monitor = {});

/// The learner of an MlpField.
std::unique_ptr<FieldLearner> make_mlp_learner(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed,
                                               const Monitor& monitor);

/// The learner of a SurfaceField.
std::unique_ptr<FieldLearner> make_surface_learner(const TrainingSet& set, const SurfaceOptions& options, const Monitor& monitor);

}  // namespace sarnerf
