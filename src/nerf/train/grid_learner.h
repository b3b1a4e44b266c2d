// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/training_set.h"
#include "train/field_learner.h"

namespace sarnerf {

/// The rows whose strip meets the box: others are 0 whatever is learned.
std::vector<RowReference> rows_that_see(const TrainingSet& set, const Box& box_m);

/// Fog wherever carving leaves room for matter, of the brightness that the images have.
GridField initial_grid_field(const TrainingSet& set, const GridOptions& options, const Monitor& monitor = {});

/// The neighbours of active voxels along the axes.
class Neighbourhood {
 public:
  explicit Neighbourhood(const GridField& field);

  /// Smoothness, a prior: ½ Σ_pairs Σ_c weight_c (p_c − q_c)² over neighbouring voxels p and q. Its gradient is added to that of
  /// the voxels whose `share` [n_active] is not 0. `parameters` and `gradient` are [n_active, n_weights].
  double smoothness(const float* parameters, std::span<const float> weight, std::span<const float> share,
                    float* gradient) const;

 private:
  std::vector<std::array<std::uint32_t, 6>> around_;  ///< places among the active voxels, its own where there is none
};

/// Adam (Kingma and Ba 2015, algorithm 1) for a GridField's parameters, in one pass over them. Voxels that no ray of
/// the batch met stay as they are, their means of gradients included: where few rows pass, what is left of an old mean
/// over an old square would go on moving them at the full rate. β₁ = 0.9; β₂ = 0.99, since rows are few and what they
/// show differs; no ε to speak of, since gradients are small numbers. Decay is decoupled
/// from the gradients (Loshchilov and Hutter 2019).
class VoxelAdam {
 public:
  explicit VoxelAdam(const GridField& field);

  /// Rates of one step.
  struct Rates {
    double density, source;
    double source_decay = 0.0;  ///< share of the brightness that goes with every step, decoupled from the gradients
  };

  /// Moves the field's parameters by their gradients. `share` [n_active]: of the rates; 0 for voxels that take no part.
  void step(GridField& field, std::span<const float> share, const Rates& rates);

  /// After prune(): of the voxels of before, these are left.
  void keep(const torch::Tensor& places);

  std::int64_t steps() const { return steps_; }
  void save(Archive& archive) const;
  void restore(const Archive& archive, std::int64_t steps, const std::string& where);

 private:
  std::int64_t steps_ = 0;
  torch::Tensor mean_density_, square_density_;  ///< [n_active]
  torch::Tensor mean_source_, square_source_;    ///< [n_active, n_harmonics]
};

/// Learns a GridField: halves its voxels and gives up empty ones in the course of the training.
class GridLearner : public FieldLearner {
 public:
  GridLearner(const TrainingSet& set, const GridOptions& options, const Monitor& monitor = {});

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, std::int64_t epoch_steps) override;
  double minimise(const torch::Tensor& pixels, const torch::Tensor& gradient, double rate) override;
  void set_ground(std::shared_ptr<const LevelGround> ground) override { field_.ground = std::move(ground); }
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  bool refinement_is_due(double progress) const;
  void refine(double progress);
  int prunings_by(double progress) const;
  bool pruning_is_due(double progress, std::int64_t epoch_steps) const;
  /// Those of less two-way depth than prune_depth.
  void give_up_empty_voxels();
  /// What was derived from which voxels there are.
  void forget_layout();
  /// Adds the gradients of the smoothness priors, and returns their sum.
  double add_smoothness(std::span<const float> shares);
  /// Shares of the learning rates: 1, and 0 for voxels that no ray of the batch met, which have no gradients of the loss.
  std::vector<float> shares() const;

  GridOptions options_;
  GridField field_;
  VoxelAdam adam_;
  std::optional<Neighbourhood> neighbours_;  ///< of the present voxels, once it was asked for
  double progress_ = 0.0;               ///< that adapt() was told last
  int level_ = 0;                       ///< halvings so far
  double level_progress_ = 0.0;         ///< of the first step since the last one
  std::int64_t steps_at_level_ = 0;     ///< since then
  std::int64_t steps_since_change_ = 0;  ///< since the last halving or pruning
  int n_prunings_ = 0;                   ///< so far, those included that came too soon
};

}  // namespace sarnerf
