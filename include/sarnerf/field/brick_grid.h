// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "sarnerf/field/brick_topology.h"

namespace sarnerf {

/// Where voxels are. Values sit at voxel centres, which have integer index coordinates, as in OpenVDB.
/// `origin_m` is in the frame of the points that are asked for: relative to the aim point for those of
/// a SampleBatch, which keeps float32 exact for scenes in map coordinates.
struct GridTransform {
  glm::dvec3 origin_m{0.0};  ///< centre of voxel (0, 0, 0)
  double voxel_size_m = 1.0;

  glm::dvec3 index_from_world(const glm::dvec3& point_m) const {
    return (point_m - origin_m) / voxel_size_m;
  }
  glm::dvec3 world_from_index(const glm::dvec3& index) const {
    return origin_m + voxel_size_m * index;
  }
};

/// A grid whose values belong to somebody else: a BrickGrid, or a tensor of a training framework.
/// `T` is float or double, const for grids that are only read.
template <class T>
struct BrickView {
  const BrickTopology* topology = nullptr;
  GridTransform transform;
  int n_channels = 1;
  std::span<T> values;  ///< [n_bricks × 512 × n_channels], channels of a voxel side by side

  T* voxel(std::uint32_t brick, int offset) const {
    return values.data() + (std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset)) *
                               static_cast<std::size_t>(n_channels);
  }

  operator BrickView<const T>() const { return {topology, transform, n_channels, values}; }
};

/// Throws UsageError unless the values have the length that topology and channels ask for.
void validate(const BrickView<const float>& grid);
void validate(const BrickView<const double>& grid);

/// Sparse grid that owns its values: new bricks are 0, and so is everything outside of them.
template <class T>
class BrickGrid {
 public:
  BrickGrid(const GridTransform& transform, int n_channels)
      : transform_(transform), n_channels_(n_channels) {}

  /// Makes room for values, so that they are allocated once. Invalidates views.
  void reserve_bricks(std::size_t n_bricks) {
    values_.reserve(n_bricks * kBrickVoxels * static_cast<std::size_t>(n_channels_));
  }

  /// The brick's number; inserted if new. Invalidates views.
  std::uint32_t touch_brick(const glm::ivec3& brick) {
    const std::uint32_t number = topology_.insert(brick);
    values_.resize(topology_.n_bricks() * kBrickVoxels * static_cast<std::size_t>(n_channels_));
    return number;
  }

  /// Channels of a voxel; its brick is inserted if new, which invalidates views.
  std::span<T> touch_voxel(const glm::ivec3& voxel) {
    const std::uint32_t brick = touch_brick(brick_of_voxel(voxel));
    return {view().voxel(brick, offset_in_brick(voxel)), static_cast<std::size_t>(n_channels_)};
  }

  const BrickTopology& topology() const { return topology_; }
  const GridTransform& transform() const { return transform_; }
  int n_channels() const { return n_channels_; }

  BrickView<T> view() { return {&topology_, transform_, n_channels_, values_}; }
  BrickView<const T> view() const { return {&topology_, transform_, n_channels_, values_}; }

 private:
  BrickTopology topology_;
  GridTransform transform_;
  int n_channels_;
  std::vector<T> values_;
};

}  // namespace sarnerf
