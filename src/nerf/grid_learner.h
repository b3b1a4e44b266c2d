// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "sarnerf/core/monitor.h"
#include "field_learner.h"
#include "grid_learning.h"
#include "smoothness.h"
#include "voxel_adam.h"

namespace sarnerf {

/// Learns a GridField: halves its voxels and gives up those that are not needed as training goes on, once enough steps
/// have shown which.
class GridLearner : public FieldLearner {
 public:
  /// `rows_per_step`: how many rows each call of minimise() learns from.
  GridLearner(const TrainingSet& set, const GridOptions& options, int rows_per_step, const Monitor& monitor = {});

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, const TrainingSet& set, const RaySampling& sampling) override;
  void minimise(const torch::Tensor& loss, double rate) override;
  void finish(const TrainingSet& set) override;
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  bool refinement_is_due(double progress) const;
  void refine(double progress);
  int prunings_by(double progress) const;
  bool pruning_is_due(double progress, const TrainingSet& set);
  void give_up_voxels(const TrainingSet& set, const RaySampling& sampling);
  /// Of the present voxels.
  const RowsOfPass& pass(const TrainingSet& set);
  /// What was derived from which voxels there are.
  void forget_layout();
  void add_smoothness(std::span<const float> shares);
  /// Shares of the learning rates: 1, and 0 for voxels that no ray of the batch met, which have no gradients of the loss.
  std::vector<float> shares() const;

  GridOptions options_;
  int rows_per_step_;
  GridField field_;
  double source_scale_;  ///< while learning
  VoxelAdam adam_;
  std::optional<Neighbourhood> neighbours_;  ///< of the present voxels, once it was asked for
  std::optional<RowsOfPass> pass_;           ///< likewise
  double progress_ = 0.0;               ///< that adapt() was told last
  int level_ = 0;                       ///< halvings so far
  double level_progress_ = 0.0;         ///< of the first step since the last one
  std::int64_t steps_at_level_ = 0;     ///< since then
  std::int64_t steps_since_change_ = 0;  ///< since the last halving or pruning
  int n_prunings_ = 0;                  ///< so far; those that came too soon count, too
};

}  // namespace sarnerf
