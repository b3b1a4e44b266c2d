// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/nerf/occupancy_grid.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// How the fields `mlp` and `paper` are laid out and learned.
struct MlpOptions {
  MlpShape shape;
  double voxel_size_m = 0.3;        ///< of the occupancy grid, which determines where rays are sampled
  double rate = 1e-3;               ///< Adam's largest learning rate
  int warm_up_steps = 100;          ///< over which the rate rises to it
  double initial_depth = 0.2;       ///< initial two-way optical depth of a range bin
  double prune_depth =
      0.02;                ///< voxels are not sampled if they and their neighbours have less two-way depth
  int refresh_steps = 20;  ///< steps between two refreshes of the occupancy grid
  std::string integrator = "exact";  ///< or "paper-gated"
  bool literal = false;              ///< the field `paper` (MlpUnits::literal); then nothing is carved nor removed
};

/// Interpretation of the network's outputs: see MlpField.
struct MlpUnits {
  double reference_bin_m = 1.0;  ///< Δ_ref, the training images' range bin
  double source_scale = 1.0;     ///< s
  Integrator integrator = Integrator::exact;
  bool literal = false;            ///< the field `paper`: see MlpField
};

/// The field `mlp` of SAR-NeRF (printed eqs. 25–30): a network of point and direction,
///
///     κ = ReLU(σ_r) / (2 Δ_ref)       two-way depth ReLU(σ_r) per reference bin
///     S = s ln(1 + e^{S_r})           takes the role of the brightness γ; s is the scale of the images
///
/// `exact`, the default, renders S T (1 − e^−x); `paper_gated` renders S T e^−x tanh x, as in the paper. An OccupancyGrid
/// caches κ. The network is evaluated in its occupied voxels only, up to the optical depth end_depth by the cached κ: what
/// is left out has e^−end_depth of its power, apart from changes since the last refresh.
///
/// Departures from the paper: `exact` instead of `paper_gated`; S is the softplus of S_r, not S_r itself, which may be
/// negative; the encoding begins with the point itself and is normalised by a cube around the scene's box, so that its waves
/// are equally long along all axes; and the number of frequencies follows from the range bin (suitable_frequencies()) and from the
/// views (suitable_direction_frequencies()).
///
/// **The field `paper`** (`literal`) is the same network with none of these departures: Î = tanh(σ) e^(−Σ σ) S_r with σ =
/// ReLU(σ_r), the sum inclusive, S_r as the network gives it; its encoding has no more than eq. 27's sines and cosines (the weights
/// of the point itself are 0 and stay so); rays are those of an even fan over the scene's box, as many as the image has bins, one in
/// the centre of each row, with one sample in the centre of each bin inside of the box (of the part inside, at its border); all of the box
/// is sampled. The box is that of the voxels that fill the scene's box: up to two voxels larger. What the paper leaves open
/// (sizes, L, optimiser) is as in `mlp`, with L = 10. So is the scale: s (r_j Δθ / Δr) before the sum (24), which 30 leaves out. Printed
/// signs: σ ≤ 0 there.
///
/// The frame is world axes centred on the aim point.
class MlpField : public LearnedField {
 public:
  /// `voxels` as carve() returns them. All count as occupied, without an extinction: see refresh().
  MlpField(MlpNetwork network, const MlpUnits& units, const GridTransform& transform,
           CarvedVoxels voxels);

  std::string_view kind() const override { return units_.literal ? "paper" : "mlp"; }
  torch::Tensor render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const override;
  void render_rows(std::span<const RowRequest> rows, const RaySampling& sampling,
                   std::span<float> pixels) const override;
  std::vector<torch::Tensor> parameters() const override { return {network_.parameters}; }
  Box occupied_box_m() const override {
    return occupied_box(cache_.occupancy(), cache_.transform());
  }
  Integrator integrator() const override { return units_.integrator; }
  double voxel_size_m() const override { return cache_.transform().voxel_size_m; }
  std::string size_text() const override;
  Archive state() const override;

  /// Evaluates the network at all voxels that carving left. Occupied are those whose two-way depth, or a neighbour's, then
  /// exceeds `least_depth`; a negative one occupies all. Cost: one sample a voxel. The field `paper` needs none of this: all of its box is sampled.
  void refresh(double least_depth);

  /// κ (1/m) and S at points, differentiable by the parameters. Shapes as in mlp_forward().
  struct Values {
    torch::Tensor extinction_per_m, brightness;
  };
  Values evaluate(std::span<const glm::vec3> point_m, std::span<const glm::vec3> ray_direction,
                  std::span<const std::uint32_t> ray_begin) const;

  const MlpNetwork& network() const { return network_; }
  const MlpUnits& units() const { return units_; }
  const OccupancyGrid& cache() const { return cache_; }
  MlpKernel kernel() const { return kernel_; }

  /// Level ground on which rays end and whose power rows include; null if the images have none.
  std::shared_ptr<const LevelGround> ground;

  /// Selects another kernel than the processor's best one, for comparisons.
  void use_kernel(MlpKernel kernel) { kernel_ = kernel; }

  /// Restores the cached κ [n_voxels] and the threshold of occupied voxels, as state() stored them.
  void restore_cache(std::span<const float> extinction_per_m, double least_depth);

 private:
  MlpNetwork network_;
  MlpUnits units_;
  OccupancyGrid cache_;
  MlpKernel kernel_;
};

/// Largest number L of the position's frequencies whose finest wave is not shorter than one and a half range bins: at
/// least 1, at most the 10 of the authors' code.
int suitable_frequencies(const Box& scene_box_m, double bin_m);

/// Largest number L of the direction's frequencies whose finest wave, of period 2^(2 − L) in the unit vector's components, the views
/// sample four times: at least 0, at most the 4 of the authors' code. A finer wave would be free between views. (Four times and not twice,
/// because ReLUs make the second harmonic of a wave.) The sampling is the median over the views' azimuths of the larger distance to the
/// next one on either side.
int suitable_direction_frequencies(std::span<const PosedImage> images);

/// A field of fog in all voxels that carving left, as bright as fits the images. Throws UsageError for impossible options.
MlpField initial_mlp_field(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed,
    const Monitor& monitor = {});

/// The field of an archive that MlpField::state() made. Throws CheckpointError for damaged contents.
MlpField restore_mlp_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf
