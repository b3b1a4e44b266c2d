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
  int n_levels = 2;         ///< voxels begin 2^(n_levels − 1) times as large and are halved on the way
  int level_steps = 25;         ///< fewest steps with voxels of one size before they are halved
  int refine_steps_left = 60;   ///< they are not, unless so many more are to come at the pace of those so far
  int harmonics_degree = 1;  ///< of the directional brightness, 0 to 2
  double density_rate = 0.3, source_rate = 0.05;  ///< largest learning rates of a and b_lm
  double initial_depth = 0.3;       ///< two-way optical depth of a voxel to begin with
  double initial_brightness = 0.3;  ///< of the scale
  double prune_depth = 0.03;        ///< voxels of less two-way depth are given up
  double prune_from = 0.0;          ///< progress before which nothing is given up
  int n_prunings = 12;              ///< in the course of the training
  /// Share of the brightness that goes with every step, over source_rate; falls by the next. Thin fog that is bright
  /// and opaque matter that is less so may give the same image: what decays has to become opaque to stay.
  double brightness_decay = 0.0;
  double final_brightness_decay = 0.03;  ///< its share at the end
  double smooth_angular = 0.0;      ///< weight of squared differences of b_lm, l > 0, between neighbouring voxels
};

/// The field `grid` of SAR-NeRF: optical density and directional brightness on a sparse grid of voxels. LibTorch
/// holds its parameters, a number a and numbers b_lm for every active voxel:
///
///     κ = e^a / (2 Δ)          two-way depth e^a per voxel side Δ
///     γ_lm = s b_lm            coefficients of the brightness, s the scale of the images
///
/// and between voxels as sample_field() has it. The exponential lets a voxel go from fog to an opaque wall in as
/// many steps as back, and keeps a gradient at every density. Voxels that are not active have κ = γ = 0: they are
/// neither sampled nor learned.
///
/// The frame is world axes centred on the aim point.
class GridField : public LearnedField {
 public:
  GridField(const GridTransform& transform, int harmonics_degree, double source_scale);

  /// Makes the marked voxels, `active` [512 n_bricks] not 0, the field's, with parameters [n_active] and
  /// [n_active, n_harmonics] in their order. The tensors log_depth and coefficients stay the same objects, so that
  /// an optimiser that knows them goes on.
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

  /// Place of each active voxel in arrays over the topology: ascending.
  std::span<const std::uint32_t> active_voxels() const { return active_; }
  std::size_t n_active() const { return active_.size(); }
  std::size_t n_voxels() const { return topology_.n_bricks() * kBrickVoxels; }

  /// Parameters a [n_active] and b [n_active, n_harmonics], float32, requiring gradients.
  torch::Tensor log_depth, coefficients;

  /// What rays end on, if anything.
  std::shared_ptr<const LevelGround> ground;

  /// κ (1/m) and γ_lm as a grid: [n_voxels × (1 + n_harmonics)]. The second writes those of active voxels into an
  /// array that holds zeros elsewhere, or makes it.
  std::vector<float> values() const;
  void values(std::vector<float>& out) const;

  BrickView<const float> view(std::span<const float> values) const {
    return {&topology_, transform_, channels_.count(), values};
  }

  /// Derivatives by the values of active voxels, [n_active × (1 + n_harmonics)], to derivatives by the parameters.
  void parameter_gradients(std::span<const float> d_active, float* d_log_depth, float* d_coefficients) const;

  /// Memory of rendering passes that are over, for the next ones: of the size of this layout of voxels.
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

/// Gives up the active voxels whose `keep` [n_active] is 0, and bricks without any left. Returns the places of the
/// kept ones among those of before, for whoever holds arrays beside the parameters.
torch::Tensor prune(GridField& field, std::span<const std::uint8_t> keep);

/// The same field with voxels of half the size, interpolated between active voxels: extinction per metre (in the
/// logarithm) and coefficients stay what they were.
GridField refined(const GridField& field);

/// The field of an archive that GridField::state() made. Throws CheckpointError for damaged contents.
GridField restore_grid_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf
