// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "vdb_grids.h"

namespace sarnerf {

/// Bricks of a volume, and how many of their voxels answer or absorb.
struct BrickSelection {
  std::vector<glm::ivec3> bricks;  ///< in the order of x, then y, then z
  std::uint64_t n_occupied_voxels = 0;
  glm::ivec3 lowest{0}, highest{0};  ///< occupied voxels, inclusive; without meaning if there is none
};

/// Bricks that active tiles of extinction or scattering above 0 become, the largest number of one grid:
/// for refusing before anything is allocated. Cost: linear in tiles.
std::uint64_t count_tile_bricks(const VdbScene::Grids& grids);

/// Bricks with an active voxel or tile in which extinction or scattering is above 0, and those of their
/// neighbours that a cell of eight with such a voxel reaches, where the source has values. Throws
/// InputError for voxels beyond what bricks can hold. Cost: linear in leaves and in the bricks of tiles, on
/// all threads but for sorting.
BrickSelection select_bricks(const VdbScene::Grids& grids);

}  // namespace sarnerf
