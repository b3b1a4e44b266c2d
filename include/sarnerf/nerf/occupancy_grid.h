// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// Voxels that may be occupied.
struct CarvedVoxels {
  BrickTopology topology;
  std::vector<std::uint8_t> active;  ///< [512 n_bricks]

  /// Makes a voxel active.
  void add(const glm::ivec3& voxel);
};

/// The voxels of the set's box without those that are certainly empty. Nothing stands in front of the first return of an azimuth
/// row, its first pixel above 0 (a millionth of the peak). A point is therefore empty if it is nearer, by more than a voxel, than
/// the first returns of its own row and of its neighbours. One such view suffices. Points outside of all swaths are removed, too.
///
/// If the images have a background that returns power, this removes only points outside of all swaths. Over a level ground
/// (TrainingSet::ground) another rule holds: a point is empty if at least 30 % of the views that see it show bare ground both in
/// its pixel and where its shadow would lie. Points that no view sees and points below the ground are empty, too.
/// Cost: views × voxels, a few ns each.
CarvedVoxels carve(const TrainingSet& set, const GridTransform& transform, const Monitor& monitor = {});

/// The grid whose voxels' centres fill the set's box: centred horizontally, with the box's bottom halfway between two centres
/// (after a halving, a centre lies on the bottom).
GridTransform grid_transform(const TrainingSet& set, double voxel_size_m);

/// Caches the extinction of a field that is expensive to evaluate at the centres of voxels. The cache determines where
/// rays are sampled and where they end.
///
/// Voxels that carving removed stay empty. Any other voxel is occupied if its own two-way optical depth, or that of one
/// of its 26 neighbours, is above a threshold. The occupied region can therefore grow by a voxel between two refreshes.
/// Every refresh evaluates all voxels, and finds material that appears in empty space. The cache only misses material that
/// fits between voxel centres and is more than a voxel's diagonal away from any other material.
class OccupancyGrid {
 public:
  /// `voxels` as carve() gives them for this transform. Everything is occupied and without extinction.
  OccupancyGrid(const GridTransform& transform, CarvedVoxels voxels);

  /// Centres of the voxels that may be occupied, in the transform's frame, [n_voxels].
  std::vector<glm::vec3> points_m() const;
  std::size_t n_voxels() const { return places_.size(); }

  /// Stores κ (1/m) at the points. A voxel becomes occupied if its two-way depth, or that of a neighbour, is above
  /// `least_depth`. A negative threshold occupies all. Linear in voxels, about 50 ns each.
  void refresh(std::span<const float> extinction_per_m, double least_depth);

  /// Arguments of the last refresh(), and the number of voxels that are occupied since.
  std::vector<float> extinction_per_m() const;
  std::size_t n_occupied() const { return n_occupied_; }
  double least_depth() const { return least_depth_; }

  const Occupancy& occupancy() const { return *occupancy_; }
  const GridTransform& transform() const { return transform_; }
  const BrickTopology& topology() const { return topology_; }

  /// Indices of the voxels in arrays over the topology, ascending, [n_voxels].
  std::span<const std::uint32_t> places() const { return places_; }

  /// κ and a source of 0, in the form that VolumeMarcher takes.
  BrickView<const float> view() const { return {&topology_, transform_, 2, values_}; }
  static FieldChannels channels() { return {false, 0, SourceBasis::harmonics}; }

 private:
  std::vector<std::uint8_t> dilated(std::span<const std::uint8_t> marked) const;

  GridTransform transform_;
  BrickTopology topology_;
  std::vector<std::uint32_t> places_;
  std::vector<float> values_;  ///< [n_bricks × 512 × 2]
  std::unique_ptr<Occupancy> occupancy_;
  std::size_t n_occupied_ = 0;
  double least_depth_ = -1.0;
};

}  // namespace sarnerf
