// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf {

/// Which cells of an interpolated grid are not 0 throughout. A cell is the cube between eight neighbouring
/// voxel centres and has the index of the lowest; a brick of cells has 8 along a side. Exact for channels
/// that are 0 or positive.
class Occupancy {
 public:
  /// Looks at the first `n_channels` channels and, if not negative, at channel `also`. Linear in voxels.
  Occupancy(const BrickView<const float>& grid, int n_channels, int also = -1);

  /// Bricks of cells in which any is occupied. They reach one voxel further than the grid's.
  const BrickTopology& bricks() const { return bricks_; }

  /// A cell of a brick; `cell` may be anywhere in space.
  bool cell(std::uint32_t brick, const glm::ivec3& cell) const {
    const int bit = (cell.y & 7) * kBrickSide + (cell.z & 7);
    return (cells_[brick][static_cast<std::size_t>(cell.x & 7)] >> bit & 1) != 0;
  }

  /// Whether any of the 2 × 2 × 2 cells is occupied whose first one has even indices and that hold `cell`.
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

  std::uint64_t n_occupied_cells() const;
  std::uint64_t memory_bytes() const { return bricks_.memory_bytes() + cells_.size() * sizeof(Cells); }

 private:
  using Cells = std::array<std::uint64_t, kBrickSide>;  ///< one layer of constant x each, z fastest

  void occupy(const glm::ivec3& cell);

  BrickTopology bricks_;
  std::vector<Cells> cells_;  ///< per brick
};

}  // namespace sarnerf
