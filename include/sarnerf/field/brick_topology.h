// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace sarnerf {

/// Voxels along one side of a brick, and in a brick: OpenVDB's leaf nodes have the same.
inline constexpr int kBrickSide = 8;
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;

/// What BrickTopology::find() gives where there is no brick.
inline constexpr std::uint32_t kNoBrick = 0xffffffffu;

/// Bricks lie between −kMaxBrick and kMaxBrick along each axis, voxels within 2³⁰.
inline constexpr int kMaxBrick = (1 << 27) - 2;

/// Brick that holds a voxel: division by 8 towards minus infinity.
inline glm::ivec3 brick_of_voxel(const glm::ivec3& voxel) {
  return {voxel.x >> 3, voxel.y >> 3, voxel.z >> 3};
}

/// Position of a voxel in its brick, [0, 512): z fastest, as in OpenVDB's leaf nodes.
inline int offset_in_brick(const glm::ivec3& voxel) {
  return ((voxel.x & 7) * kBrickSide + (voxel.y & 7)) * kBrickSide + (voxel.z & 7);
}

/// The voxel at such a position, in a brick whose first voxel is the origin. Of a place in an array over many bricks, 512
/// voxels each, its voxel within its brick.
template <std::integral Offset>
constexpr glm::ivec3 voxel_in_brick(Offset offset) {
  return {static_cast<int>(offset >> 6 & 7), static_cast<int>(offset >> 3 & 7), static_cast<int>(offset & 7)};
}

/// Where the bricks of a sparse grid are, without their values. Bricks are numbered in the order in
/// which they were inserted; the number is the brick's place in every array of values over this
/// topology.
///
/// Two levels: a hash table of tiles of 8³ bricks, each tile a table of brick numbers. Memory grows with
/// occupied tiles, 2 KiB each, and not with the empty space between them. Beside that every brick knows
/// its neighbours, because a third of all cells of eight voxels reach into them.
class BrickTopology {
 public:
  /// Numbers of a brick and of its neighbours towards larger coordinates: bits 2, 1 and 0 of the place stand
  /// for a step along x, y and z. kNoBrick where there is none.
  using Neighbours = std::array<std::uint32_t, 8>;

  /// Number of the brick, which is appended if it is new. Throws UsageError beyond kMaxBrick. Cost: some
  /// fifteen look-ups.
  std::uint32_t insert(const glm::ivec3& brick);

  /// Number of the brick, or kNoBrick.
  std::uint32_t find(const glm::ivec3& brick) const;

  std::size_t n_bricks() const { return coordinates_.size(); }
  const glm::ivec3& coordinate(std::uint32_t brick) const { return coordinates_[brick]; }
  const Neighbours& neighbours(std::uint32_t brick) const { return neighbours_[brick]; }

  /// All of the index's memory, allocated or used.
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

/// Finds many bricks that lie close to one another: remembers the last tile, so that most look-ups are one
/// comparison and one load. The topology must outlive it and not change meanwhile. One per thread.
class BrickFinder {
 public:
  explicit BrickFinder(const BrickTopology& topology) : topology_(topology) {}

  std::uint32_t find(const glm::ivec3& brick) {
    if (brick_of_voxel(brick) != tile_) go_to_tile(brick_of_voxel(brick));
    return numbers_ ? (*numbers_)[static_cast<std::size_t>(offset_in_brick(brick))] : kNoBrick;
  }

  /// Whether the brick lies in a tile, 8 bricks along a side, without any.
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

}  // namespace sarnerf
