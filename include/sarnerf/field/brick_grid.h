// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace sarnerf {

/// Voxels along one side of a brick, and in a brick, as in OpenVDB's leaf nodes.
inline constexpr int kBrickSide = 8;
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;

/// Returned by BrickTopology::find() where there is no brick.
inline constexpr std::uint32_t kNoBrick = 0xffffffffu;

/// Bricks lie between −kMaxBrick and kMaxBrick along each axis, voxels within 2³⁰.
inline constexpr int kMaxBrick = (1 << 27) - 2;

/// Brick that holds a voxel: division by 8 towards minus infinity.
inline glm::ivec3 brick_of_voxel(const glm::ivec3& voxel) {
  return {voxel.x >> 3, voxel.y >> 3, voxel.z >> 3};
}

/// Offset of a voxel in its brick, [0, 512): z fastest, as in OpenVDB's leaf nodes.
inline int offset_in_brick(const glm::ivec3& voxel) {
  return ((voxel.x & 7) * kBrickSide + (voxel.y & 7)) * kBrickSide + (voxel.z & 7);
}

/// The inverse: the voxel at an offset, relative to the first voxel of its brick. The offset may also be an index into an
/// array over many bricks, 512 voxels each.
template <std::integral Offset>
constexpr glm::ivec3 voxel_in_brick(Offset offset) {
  return {static_cast<int>(offset >> 6 & 7), static_cast<int>(offset >> 3 & 7), static_cast<int>(offset & 7)};
}

/// Positions of the bricks of a sparse grid, without their values. Bricks are numbered in the order in
/// which they were inserted; the number is the brick's index in every array of values over this
/// topology.
///
/// Two levels: a hash table of tiles of 8³ bricks, each tile a table of brick numbers. Memory grows with
/// the number of occupied tiles, 2 KiB each, and not with the empty space between them. In addition, the numbers
/// of each brick's neighbours are stored, because a third of all cells of eight voxels reach into them.
class BrickTopology {
 public:
  /// Numbers of a brick and of its neighbours towards larger coordinates: bits 2, 1 and 0 of the index stand
  /// for a step along x, y and z. kNoBrick where there is no brick.
  using Neighbours = std::array<std::uint32_t, 8>;

  /// Number of the brick, which is appended if it is new. Throws UsageError beyond kMaxBrick. Cost: about
  /// fifteen look-ups.
  std::uint32_t insert(const glm::ivec3& brick);

  /// Number of the brick, or kNoBrick.
  std::uint32_t find(const glm::ivec3& brick) const;

  std::size_t n_bricks() const { return coordinates_.size(); }
  const glm::ivec3& coordinate(std::uint32_t brick) const { return coordinates_[brick]; }
  /// The voxel of an index into arrays over the topology, brick × 512 + offset.
  glm::ivec3 voxel(std::size_t index) const { return coordinates_[index / kBrickVoxels] * kBrickSide + voxel_in_brick(index); }
  const Neighbours& neighbours(std::uint32_t brick) const { return neighbours_[brick]; }

  /// All allocated memory, used or not.
  std::size_t memory_bytes() const;

 private:
  friend class BrickFinder;
  static constexpr std::uint32_t kNoTile = 0xffffffffu;
  using Tile = std::array<std::uint32_t, kBrickVoxels>;  // as many bricks as a brick has voxels

  struct Slot {
    glm::ivec3 tile{0};
    std::uint32_t index = kNoTile;
  };

  std::size_t slot_of(const glm::ivec3& tile) const;
  std::uint32_t insert_tile(const glm::ivec3& tile);

  std::vector<Slot> slots_;  ///< open addressing, a power of two, at most half full
  std::vector<Tile> tiles_;
  std::vector<glm::ivec3> coordinates_;
  std::vector<Neighbours> neighbours_;
};

/// Finds many bricks that lie close to one another. It keeps the last tile, so that most look-ups are one
/// comparison and one load. The topology must outlive it and not change meanwhile. One per thread.
class BrickFinder {
 public:
  explicit BrickFinder(const BrickTopology& topology) : topology_(topology) {}

  std::uint32_t find(const glm::ivec3& brick) {
    if (brick_of_voxel(brick) != tile_) go_to_tile(brick_of_voxel(brick));
    return numbers_ ? (*numbers_)[static_cast<std::size_t>(offset_in_brick(brick))] : kNoBrick;
  }

  /// Whether the brick lies in a tile, 8 bricks along a side, that has no bricks.
  bool in_empty_tile(const glm::ivec3& brick) {
    if (brick_of_voxel(brick) != tile_) go_to_tile(brick_of_voxel(brick));
    return numbers_ == nullptr;
  }

 private:
  void go_to_tile(const glm::ivec3& tile);

  const BrickTopology& topology_;
  glm::ivec3 tile_{0x7fffffff};  // beyond the tile of any brick
  const BrickTopology::Tile* numbers_ = nullptr;
};

/// From points to voxel indices. Values belong to voxel centres, which have integer index coordinates, as in
/// OpenVDB. `origin_m` is in the frame of the sampled points: relative to the aim point for those of
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

/// A grid whose values are owned elsewhere: by a BrickGrid, or by a tensor of a training framework.
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

/// Throws UsageError unless there are a topology, a channel or more, a positive voxel size, and as many values as
/// topology and channels require.
void validate(const BrickView<const float>& grid);
void validate(const BrickView<const double>& grid);

/// Sparse grid that owns its values. New bricks are 0, and so is the space outside of all bricks.
template <class T>
class BrickGrid {
 public:
  BrickGrid(const GridTransform& transform, int n_channels)
      : transform_(transform), n_channels_(n_channels) {}

  /// Reserves memory for the values, so that they are allocated once. Invalidates views.
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

/// The occupied cells of an interpolated grid: those with a corner that is not 0. A cell is the cube between eight
/// neighbouring voxel centres and has the index of the lowest; a brick of cells has 8 along a side. Exact for
/// channels that are 0 or positive.
class Occupancy {
 public:
  /// Uses the first `n_channels` channels and, if `also` is not negative, channel `also`. Linear in voxels.
  Occupancy(const BrickView<const float>& grid, int n_channels, int also = -1);

  /// Bricks of cells with an occupied cell. They reach one voxel further than the grid's bricks, towards smaller indices.
  const BrickTopology& bricks() const { return bricks_; }

  /// Whether a cell is occupied, given the number of the brick that holds it; `cell` is its index in the whole grid.
  bool cell(std::uint32_t brick, const glm::ivec3& cell) const {
    const int bit = (cell.y & 7) * kBrickSide + (cell.z & 7);
    return (cells_[brick][static_cast<std::size_t>(cell.x & 7)] >> bit & 1) != 0;
  }

  /// Whether any cell is occupied in the block of 2 × 2 × 2 cells that holds `cell` and begins at even indices.
  bool block(std::uint32_t brick, const glm::ivec3& cell) const {
    const int bit = (cell.y & 6) * kBrickSide + (cell.z & 6);
    const std::uint64_t square = std::uint64_t{0x303} << bit;
    const auto x = static_cast<std::size_t>(cell.x & 6);
    return ((cells_[brick][x] | cells_[brick][x + 1]) & square) != 0;
  }

  /// Smallest box of a brick's occupied cells, [first, last] within the brick.
  struct CellBox {
    glm::ivec3 first, last;
  };
  CellBox cell_box(std::uint32_t brick) const;

  std::uint64_t memory_bytes() const { return bricks_.memory_bytes() + cells_.size() * sizeof(Cells); }

 private:
  using Cells = std::array<std::uint64_t, kBrickSide>;  ///< a bit per cell; one layer of constant x each, z fastest

  void occupy(const glm::ivec3& cell);

  BrickTopology bricks_;
  std::vector<Cells> cells_;  ///< per brick
};

}  // namespace sarnerf
