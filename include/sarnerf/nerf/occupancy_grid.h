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

/// Voxels that may hold matter.
struct CarvedVoxels {
  BrickTopology topology;
  std::vector<std::uint8_t> active;  ///< [512 n_bricks]
};

/// The voxels of the set's box without those that are certainly empty: nothing stands in front of what a row
/// returns first, so a place nearer than the first pixel above 0 (a millionth of the peak) of its own row and of its neighbours, by
/// a voxel or more, is empty. One view that says so suffices. A place outside of all swaths
/// is given up, too.
///
/// Images with a background that returns power carve nothing so but what lies outside of all swaths. Over a level ground
/// (Clutter) a place is empty when three in ten of the views that see it show ground both in its pixel and where its shadow
/// would lie, or when fewer than a quarter of all views see it; nothing lies below. Cost: views × voxels, a few ns
/// each.
CarvedVoxels carve(const TrainingSet& set, const GridTransform& transform, const Monitor& monitor = {});

/// The grid whose voxels' centres fill the set's box, centred in it.
GridTransform grid_transform(const TrainingSet& set, double voxel_size_m);

/// The extinction of a field that is expensive to evaluate, remembered at the centres of voxels: where rays are
/// sampled and where they end is decided by it.
///
/// Voxels that carving gave up are empty for ever. Of the others those count as occupied whose own two-way optical
/// depth, or that of one of their 26 neighbours, is above a threshold, so that matter can grow by a voxel at its
/// surface between two refreshes; and since every refresh looks at all voxels, what appears in empty space is found
/// again. What is lost is matter that fits between voxel centres by more than a voxel's diagonal from any other.
class OccupancyGrid {
 public:
  /// `voxels` as carve() gives them for this transform. Everything is occupied and without extinction.
  OccupancyGrid(const GridTransform& transform, CarvedVoxels voxels);

  /// Centres of the voxels that may hold matter, in the transform's frame, [n_voxels].
  std::vector<glm::vec3> points_m() const;
  std::size_t n_voxels() const { return places_.size(); }

  /// Remembers κ (1/m) at the points, and which voxels have a two-way depth above `least_depth` per voxel or
  /// a neighbour that has. A negative threshold occupies all. Linear in voxels, about 50 ns each.
  void refresh(std::span<const float> extinction_per_m, double least_depth);

  /// What the last refresh() was given, and the voxels it left occupied.
  std::vector<float> extinction_per_m() const;
  std::size_t n_occupied() const { return n_occupied_; }
  double least_depth() const { return least_depth_; }

  const Occupancy& occupancy() const { return *occupancy_; }
  const GridTransform& transform() const { return transform_; }
  const BrickTopology& topology() const { return topology_; }

  /// Places of the voxels in arrays over the topology, ascending, [n_voxels].
  std::span<const std::uint32_t> places() const { return places_; }

  /// κ and a source of 0, as VolumeMarcher takes them.
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
