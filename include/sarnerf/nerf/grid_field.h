// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sarnerf/field/field_sampler.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/ground.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// How the field `grid` is laid out and learned.
struct GridOptions {
  double voxel_size_m = 0.2;
  int n_levels = 2;         ///< initial voxels are 2^(n_levels − 1) times as large, and are halved during the training
  int level_steps = 25;         ///< smallest number of steps with voxels of one size before they are halved
  int refine_steps_left = 60;   ///< voxels are halved only if this many steps remain at the present pace
  int harmonics_degree = 1;  ///< of the directional brightness, 0 to 2
  double density_rate = 0.3, source_rate = 0.05;  ///< largest learning rates of a and b_lm
  double initial_depth = 0.3;       ///< initial two-way optical depth of a voxel
  double initial_brightness = 0.3;  ///< in units of the scale s
  double prune_depth = 0.03;        ///< voxels of less two-way depth are removed
  double prune_from = 0.0;          ///< progress before which no voxels are removed
  int n_prunings = 10;              ///< number of prunings during the training
};

/// The field `grid` of SAR-NeRF: optical density and directional brightness on a sparse grid of voxels. Its
/// parameters, in tensors of LibTorch, are a and b_lm for every active voxel:
///
///     κ = e^a / (2 Δ)          two-way depth e^a per voxel side Δ
///     γ_lm = s b_lm            coefficients of the brightness, s the scale of the images
///
/// sample_field() interpolates κ and γ_lm between voxels. Due to the exponential, a voxel takes as many steps from
/// translucent to opaque as back, and has a gradient at every density. Inactive voxels have κ = γ = 0: they are
/// neither sampled nor learned.
///
/// The frame is world axes centred on the aim point.
class GridField : public LearnedField {
 public:
  GridField(const GridTransform& transform, int harmonics_degree, double source_scale);

  /// Replaces the field's voxels by those whose `active` [512 n_bricks] is not 0, with parameters [n_active] and
  /// [n_active, n_harmonics] in their order. The tensors log_depth and coefficients stay the same objects, so that
  /// an optimiser that holds them remains valid.
  void set_voxels(BrickTopology topology, std::span<const std::uint8_t> active,
                  const torch::Tensor& new_log_depth, const torch::Tensor& new_coefficients);

  std::string_view kind() const override { return "grid"; }
  torch::Tensor render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const override;
  void render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                   std::span<float> pixels) const override;
  std::vector<torch::Tensor> parameters() const override { return {log_depth, coefficients}; }
  Box occupied_box_m() const override { return occupied_box(*occupancy_, transform_); }
  double voxel_size_m() const override { return transform_.voxel_size_m; }
  std::string size_text() const override;
  Archive state() const override;

  const BrickTopology& topology() const { return topology_; }
  const GridTransform& transform() const { return transform_; }
  const FieldChannels& channels() const { return channels_; }
  const Occupancy& occupancy() const { return *occupancy_; }
  double source_scale() const { return source_scale_; }  ///< s

  /// Index of each active voxel in arrays over the topology, ascending.
  std::span<const std::uint32_t> active_voxels() const { return active_; }
  std::size_t n_active() const { return active_.size(); }
  std::size_t n_voxels() const { return topology_.n_bricks() * kBrickVoxels; }

  /// Parameters a [n_active] and b [n_active, n_harmonics], float32, requiring gradients.
  torch::Tensor log_depth, coefficients;

  /// Ground on which rays end; null if there is none.
  std::shared_ptr<const LevelGround> ground;

  /// κ (1/m) and γ_lm as a grid: [n_voxels × (1 + n_harmonics)]. The second writes only the values of active voxels, into
  /// an array that must hold zeros elsewhere; an array of another size is replaced.
  std::vector<float> values() const;
  void values(std::vector<float>& out) const;

  BrickView<const float> view(std::span<const float> values) const {
    return {&topology_, transform_, channels_.count(), values};
  }

  /// Converts derivatives by the values of active voxels, [n_active × (1 + n_harmonics)], to derivatives by the parameters.
  void parameter_gradients(std::span<const float> d_active, float* d_log_depth, float* d_coefficients) const;

  /// Memory of finished rendering passes, reused by later ones. Its size fits the present voxels.
  struct Memory {
    std::vector<float> values, d_active;
    std::shared_ptr<RowMemory> rows;
  };
  std::shared_ptr<std::vector<Memory>> idle_memory() const { return idle_memory_; }

 private:
  GridTransform transform_;
  FieldChannels channels_;
  double source_scale_;
  BrickTopology topology_;
  std::vector<std::uint32_t> active_;
  std::unique_ptr<Occupancy> occupancy_;
  std::shared_ptr<std::vector<Memory>> idle_memory_;
};

/// Removes the active voxels whose `keep` [n_active] is 0, and bricks without active voxels. Returns the indices of the
/// kept voxels among the former ones, for arrays that are parallel to the parameters.
torch::Tensor prune(GridField& field, std::span<const std::uint8_t> keep);

/// The same field with voxels of half the size: the logarithm of the extinction per metre and the coefficients are
/// interpolated between active voxels.
GridField refined(const GridField& field);

/// The field of an archive that GridField::state() made. Throws CheckpointError for damaged contents.
GridField restore_grid_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf
