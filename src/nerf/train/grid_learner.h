// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/training_set.h"
#include "train/field_learner.h"

namespace sarnerf {

/// The rows whose strip meets the box. Other rows do not depend on what is learned.
std::vector<RowReference> rows_that_see(const TrainingSet& set, const Box& box_m);

/// Translucent voxels wherever carving left any, with a brightness in units of the images' (TrainingSet::bright).
GridField initial_grid_field(const TrainingSet& set, const GridOptions& options, const Monitor& monitor = {});

/// Adam (Kingma and Ba 2015, algorithm 1) for a GridField's parameters, in one pass over them. Voxels whose gradient is
/// exactly 0 (no ray of the batch met them) keep their parameters and moments: where few rows pass, the ratio of an old mean
/// to an old square would continue to move them at the full rate. Bias correction counts all steps. β₁ = 0.9; β₂ = 0.99,
/// since rows are few and differ from one another; ε is negligible (1e-15), since gradients are small.
class VoxelAdam {
 public:
  explicit VoxelAdam(const GridField& field);

  /// Rates of one step.
  struct Rates {
    double density, source;
  };

  /// Updates the field's parameters from their gradients. `moves` [n_active]: 0 leaves a voxel unchanged.
  void step(GridField& field, std::span<const std::uint8_t> moves, const Rates& rates);

  /// After prune(): keeps the moments of the voxels at these former indices.
  void keep(const torch::Tensor& places);

  std::int64_t steps() const { return steps_; }
  void save(Archive& archive) const;
  void restore(const Archive& archive, std::int64_t steps, const std::string& where);

 private:
  std::int64_t steps_ = 0;
  torch::Tensor mean_density_, square_density_;  ///< [n_active]
  torch::Tensor mean_source_, square_source_;    ///< [n_active, n_harmonics]
};

/// Learns a GridField: halves its voxels and removes empty ones during the training.
class GridLearner : public FieldLearner {
 public:
  GridLearner(const TrainingSet& set, const GridOptions& options, const Monitor& monitor = {});

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, std::int64_t epoch_steps) override;
  void minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) override;
  void set_ground(std::shared_ptr<const LevelGround> ground) override { field_.ground = std::move(ground); }
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  bool refinement_is_due(double progress) const;
  void refine(double progress);
  int prunings_by(double progress) const;
  bool pruning_is_due(double progress, std::int64_t epoch_steps) const;
  /// Removes voxels of less two-way depth than prune_depth.
  void prune_voxels();
  /// 0 for voxels whose gradient is exactly 0, else 1; [n_active].
  std::vector<std::uint8_t> voxels_with_gradient() const;

  GridOptions options_;
  GridField field_;
  VoxelAdam adam_;
  int level_ = 0;                       ///< halvings so far
  double level_progress_ = 0.0;         ///< progress at the first step since the last halving
  std::int64_t steps_at_level_ = 0;     ///< steps since the last halving
  std::int64_t steps_since_change_ = 0;  ///< steps since the last halving or pruning
  int n_prunings_ = 0;                   ///< prunings so far, including those that were skipped because they came too soon
};

}  // namespace sarnerf
