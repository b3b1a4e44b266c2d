// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/occupancy.h"

#include <algorithm>
#include <bit>

namespace sarnerf {

Occupancy::Occupancy(const BrickView<const float>& grid, int n_channels, int also) {
  const BrickTopology& voxels = *grid.topology;
  for (std::uint32_t brick = 0; brick < voxels.n_bricks(); ++brick) {
    const glm::ivec3 origin = voxels.coordinate(brick) * kBrickSide;
    for (int n = 0; n < kBrickVoxels; ++n) {
      const float* voxel = grid.voxel(brick, n);
      bool occupied = also >= 0 && voxel[also] != 0.0f;
      for (int c = 0; c < n_channels; ++c) occupied |= voxel[c] != 0.0f;
      if (!occupied) continue;
      // The voxel is a corner of eight cells.
      const glm::ivec3 at = origin + voxel_in_brick(n);
      for (int corner = 0; corner < 8; ++corner) {
        occupy(at - glm::ivec3(corner >> 2, corner >> 1 & 1, corner & 1));
      }
    }
  }
}

void Occupancy::occupy(const glm::ivec3& cell) {
  const std::uint32_t brick = bricks_.insert(brick_of_voxel(cell));
  if (brick == cells_.size()) cells_.emplace_back().fill(0);
  cells_[brick][static_cast<std::size_t>(cell.x & 7)] |=
      std::uint64_t{1} << ((cell.y & 7) * kBrickSide + (cell.z & 7));
}

Occupancy::CellBox Occupancy::cell_box(std::uint32_t brick) const {
  CellBox box{glm::ivec3(kBrickSide), glm::ivec3(-1)};
  for (int x = 0; x < kBrickSide; ++x) {
    const std::uint64_t layer = cells_[brick][static_cast<std::size_t>(x)];
    for (int bit = 0; bit < 64; ++bit) {
      if ((layer >> bit & 1) == 0) continue;
      box.first = glm::min(box.first, glm::ivec3(x, bit >> 3, bit & 7));
      box.last = glm::max(box.last, glm::ivec3(x, bit >> 3, bit & 7));
    }
  }
  return box;
}

std::uint64_t Occupancy::n_occupied_cells() const {
  std::uint64_t n = 0;
  for (const Cells& cells : cells_) {
    for (const std::uint64_t layer : cells) n += static_cast<std::uint64_t>(std::popcount(layer));
  }
  return n;
}

}  // namespace sarnerf
