// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <torch/types.h>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/occupancy_grid.h"

namespace sarnerf {

/// How the field `surface` is laid out and learned. Bins are range bins of the finest image.
struct SurfaceOptions {
  double voxel_size_m = 0.15;
  std::string start = "hull";      ///< the first body: the carved hull, its bounding "box", or the "sphere" around that
  bool bounce = false;             ///< over a ground: double bounces by it (SurfaceField::start_bounce)
  int n_levels = 2;                ///< initial voxels are 2^(n_levels − 1) times as large, and are halved during the training
  /// Progress of the training at which the shape is complete. Then its distance, albedo and exponent stay as they are, and the
  /// rest of the training is that of the directional brightness. `refined_by` and `anneal_until` are fractions of the shape's part.
  double shape_until = 0.8;
  double refined_by = 0.4;         ///< the last halving; earlier ones are at equal intervals before
  double albedo_bins = 1.0;        ///< voxels of the albedo
  double initial_softness_bins = 1.0, final_softness_bins = 0.1;  ///< 1 / s
  double anneal_until = 0.8;       ///< where the softness becomes the final one
  double step_bins = 0.25;         ///< largest step of the distance
  /// a of the gradient's filter (1 − a ∂²)⁻¹, which is applied twice, at the start and with the final softness
  double smoothing_bins2 = 3.0, final_smoothing_bins2 = 0.3;
  double albedo_smoothing_bins2 = 100.0, final_albedo_smoothing_bins2 = 1.0;  ///< the same of the albedo
  double least_moment = 0.01;      ///< least root mean square of a parameter's gradient, as a part of the largest one
  double beyond_hull_bins = 0.25;  ///< how far the surface may lie outside of the carved hull
  int redistance_steps = 25;       ///< steps between two redistancings
  int refresh_steps = 5;           ///< steps between two updates of the occupied space
  int reached_steps = 50;          ///< voxels that no ray has reached for so many steps keep their distance
  double albedo_rate = 0.05, exponent_rate = 0.02, directional_rate = 0.03;
};

/// The field `surface`: an opaque body bounded by the level 0 of a signed distance f (m, negative inside), and the brightness of
/// its surface.
///
///     two-way extinction  2 κ = s Ψ(−s f)            Ψ: Laplace's distribution function, s the sharpness (VolSDF,
///                                                    Yariv et al. 2021)
///     brightness          γ = e^(a + b) cos^p        cos = −d·n, n = ∇f / √(|∇f|² + 0.1²)
///                         b(d) = Σ_lm D_lm Y_lm(d)   d: the ray's direction; l ≤ 2; 0 until start_directional()
///     by the ground       γ' = e^c cos'^p            cos' = −d'·n, d': the ray's horizontal direction, of length 1; 0 until
///                                                    start_bounce()
///
/// f is interpolated trilinearly on a sparse grid; the log albedos a and c and the coefficients D_lm on a coarse grid; the exponent
/// p is one number. b corrects what e^a cos^p cannot show: edges that the lattice rounds off are too bright where they face the
/// radar, and albedos differ on scales below a voxel of the albedo. It belongs to the views, not to the body: volumes do not
/// have it. A segment has the depth of a distance that changes linearly between its ends, in closed form (mpa/surface_density.h). The
/// normal n is that at the segment's centre, from the gradient of the interpolated f. Its length is
/// divided out, since the filters of learning leave |∇f| below 1 where the surface bends, and brightness must not depend on that; the 0.1
/// lets n fade where f has a ridge, in the middle of thin members. Where cos falls below 0.01, γ falls linearly to 0.
///
/// γ' is the brightness of the double bounce between a level ground and the body (Path::by_ground). A point of the body returns it
/// in the range bin of its foot. It is brightest where the bisector between both directions of the path, which is horizontal,
/// is normal to the surface: on walls that face the radar. Where the ground around is itself hidden from the point is not
/// tested: a path by the ground counts as free where the direct one is.
///
/// With the sharpness, the surface's place is defined ever better: half of a ray's power returns from nearer than a point 0.4 / s
/// inside (normal incidence) to 0.8 / s outside (70°) of the level 0, measured along the normal.
///
/// The frame is world axes centred on the aim point.
class SurfaceField : public LearnedField {
 public:
  /// A grid of distances on `topology`, and of log albedos on voxels of `albedo_voxel_m` around it. The topology must hold every
  /// voxel that is nearer than `most_band_m` to where the surface may be. f = most_band_m everywhere, a = 0, p = 1; s is as small
  /// as the band allows.
  SurfaceField(const GridTransform& transform, BrickTopology topology, double albedo_voxel_m, double most_band_m);

  std::string_view kind() const override { return "surface"; }
  torch::Tensor render_rows(std::span<const RowRequest> rows, const RaySampling& sampling) const override;
  void render_rows(std::span<const RowRequest> rows, const RaySampling& sampling, std::span<float> pixels) const override;
  /// Those that are learned at present: f, a, p and c if there is a bounce, or D alone.
  std::vector<torch::Tensor> parameters() const override;
  Box occupied_box_m() const override;
  double voxel_size_m() const override { return transform_.voxel_size_m; }
  std::string size_text() const override;
  Archive state() const override;

  /// Parameters, float32, requiring gradients: f (m) [n_voxels], a [n_albedo_voxels], p [1], c [n_albedo_voxels] or [0],
  /// D [n_albedo_voxels, 9] or [0, 9].
  torch::Tensor distance, log_albedo, exponent, log_bounce, directional;

  /// Adds the double bounce by the ground, with c = a. It is rendered only where there is a ground.
  void start_bounce();
  bool has_bounce() const { return log_bounce.numel() > 0; }

  /// Fixes f, a, p and c: from now on they get no gradients, and D does, which is 0 at first.
  void start_directional();
  bool has_directional() const { return directional.numel() > 0; }

  /// s (1/m). Space so far outside of the surface that less than 0.005 of two-way depth (at normal incidence) lies beyond is left
  /// out.
  double sharpness_per_m() const { return sharpness_per_m_; }
  void set_sharpness(double per_m) { sharpness_per_m_ = per_m; }
  /// Finds the occupied space anew, after the distance or the sharpness has changed.
  void refresh();
  /// Restores the occupied space of a former refresh(), after which cache().extinction_per_m() had these values.
  void restore_cache(std::span<const float> extinction_per_m) { cache_.refresh(extinction_per_m, 0.0); }

  const BrickTopology& topology() const { return cache_.topology(); }
  const GridTransform& transform() const { return transform_; }
  const GridTransform& albedo_transform() const { return albedo_transform_; }
  const BrickTopology& albedo_topology() const { return albedo_topology_; }
  const OccupancyGrid& cache() const { return cache_; }
  std::size_t n_voxels() const { return topology().n_bricks() * kBrickVoxels; }
  double most_band_m() const { return most_band_m_; }
  /// Distance beyond which space is left out, at a sharpness where the grid's band is wide enough, and now.
  static double band_m(double sharpness_per_m);
  double band_m() const;

  /// Ground on which rays end; null if there is none.
  std::shared_ptr<const LevelGround> ground;

 private:
  GridTransform transform_, albedo_transform_;
  BrickTopology albedo_topology_;
  OccupancyGrid cache_;
  double most_band_m_, sharpness_per_m_;
};

/// The same field on voxels of half the size, of which every second one is a former one. Bricks are left out that lie farther
/// outside than `reach_m` beyond what rays can notice at the present sharpness.
SurfaceField refined(const SurfaceField& field, double reach_m);

/// Values of a field's distance voxels, interpolated at those of refined(); `beyond` where the field has no brick.
torch::Tensor refined_values(const SurfaceField& field, const torch::Tensor& values, const SurfaceField& fine, float beyond);

/// Values of albedo voxels at those of refined().
torch::Tensor refined_albedo(const SurfaceField& field, const torch::Tensor& values, const SurfaceField& fine);

/// The field of an archive that SurfaceField::state() made. Throws CheckpointError for damaged contents.
SurfaceField restore_surface_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf
