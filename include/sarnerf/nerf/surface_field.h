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

/// The field `surface`: an opaque body bounded by the level 0 of a signed distance f (m, negative inside), and the brightness of
/// its surface.
///
///     two-way extinction  2 κ = s Ψ(−s f)            Ψ: Laplace's distribution function, s the sharpness (VolSDF,
///                                                    Yariv et al. 2021)
///     brightness          γ = e^a cos^p              cos: what f falls by along the ray, per metre
///
/// f is interpolated trilinearly on a sparse grid; the log albedo a on a coarse grid; the exponent p is one number. A segment
/// has the depth of a distance that changes linearly between its ends, in closed form (mpa/surface_density.h). cos is the cosine
/// of the incidence, since the gradient of a distance has length 1: no normals are computed. Where cos falls below 0.01, γ falls
/// linearly to 0.
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
  std::vector<torch::Tensor> parameters() const override { return {distance, log_albedo, exponent}; }
  Box occupied_box_m() const override;
  double voxel_size_m() const override { return transform_.voxel_size_m; }
  std::string size_text() const override;
  Archive state() const override;

  /// Parameters, float32, requiring gradients: f (m) [n_voxels], a [n_albedo_voxels], p [1].
  torch::Tensor distance, log_albedo, exponent;

  /// s (1/m). Space so far outside of the surface that less than 0.005 of two-way depth (at normal incidence) lies beyond is left
  /// out.
  double sharpness_per_m() const { return sharpness_per_m_; }
  void set_sharpness(double per_m) { sharpness_per_m_ = per_m; }
  /// Finds the occupied space anew, after the distance or the sharpness has changed.
  void refresh();

  const BrickTopology& topology() const { return cache_.topology(); }
  const GridTransform& transform() const { return transform_; }
  const GridTransform& albedo_transform() const { return albedo_transform_; }
  const BrickTopology& albedo_topology() const { return albedo_topology_; }
  const OccupancyGrid& cache() const { return cache_; }
  std::size_t n_voxels() const { return topology().n_bricks() * kBrickVoxels; }
  double most_band_m() const { return most_band_m_; }
  double band_m() const;  ///< distance beyond which space is left out

  /// Ground on which rays end; null if there is none.
  std::shared_ptr<const LevelGround> ground;

 private:
  GridTransform transform_, albedo_transform_;
  BrickTopology albedo_topology_;
  OccupancyGrid cache_;
  double most_band_m_, sharpness_per_m_;
};

/// The field of an archive that SurfaceField::state() made. Throws CheckpointError for damaged contents.
SurfaceField restore_surface_field(const Archive& archive, const std::string& where);

}  // namespace sarnerf
