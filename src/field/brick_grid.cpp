// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/brick_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

/// Neighbouring tiles differ in low bits only. Multiplication carries them to the high bits, the shifts back down.
std::size_t hash(const glm::ivec3& tile) {
  std::uint64_t h = static_cast<std::uint32_t>(tile.x) * 0x9e3779b97f4a7c15ull;
  h = (h ^ (h >> 32) ^ static_cast<std::uint32_t>(tile.y)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 32) ^ static_cast<std::uint32_t>(tile.z)) * 0x94d049bb133111ebull;
  return static_cast<std::size_t>(h ^ (h >> 32));
}

}  // namespace

std::size_t BrickTopology::slot_of(const glm::ivec3& tile) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = hash(tile) & mask;
  while (slots_[slot].index != kNoTile && slots_[slot].tile != tile) slot = (slot + 1) & mask;
  return slot;
}

std::uint32_t BrickTopology::insert_tile(const glm::ivec3& tile) {
  if (2 * (tiles_.size() + 1) > slots_.size()) {
    const std::vector<Slot> old = std::move(slots_);
    slots_.assign(old.empty() ? 8 : 2 * old.size(), {});
    for (const Slot& s : old) {
      if (s.index != kNoTile) slots_[slot_of(s.tile)] = s;
    }
  }
  Slot& slot = slots_[slot_of(tile)];
  if (slot.index == kNoTile) {
    slot = {tile, static_cast<std::uint32_t>(tiles_.size())};
    tiles_.emplace_back().fill(kNoBrick);
  }
  return slot.index;
}

std::uint32_t BrickTopology::insert(const glm::ivec3& brick) {
  for (int axis = 0; axis < 3; ++axis) {
    if (brick[axis] < -kMaxBrick || brick[axis] > kMaxBrick) {
      throw UsageError("bricks lie within " + std::to_string(kMaxBrick) +
                       " of the origin, found one at " + std::to_string(brick[axis]) +
                       "; choose larger voxels or an origin in the scene");
    }
  }
  // A tile is to bricks what a brick is to voxels.
  std::uint32_t& place =
      tiles_[insert_tile(brick_of_voxel(brick))][static_cast<std::size_t>(offset_in_brick(brick))];
  if (place != kNoBrick) return place;
  if (coordinates_.size() == kNoBrick) throw UsageError("a grid holds at most 4294967295 bricks");
  const auto number = static_cast<std::uint32_t>(coordinates_.size());
  place = number;
  coordinates_.push_back(brick);
  Neighbours& own = neighbours_.emplace_back();
  own[0] = number;
  for (int n = 1; n < 8; ++n) {
    const glm::ivec3 step(n >> 2 & 1, n >> 1 & 1, n & 1);
    own[static_cast<std::size_t>(n)] = find(brick + step);
    const std::uint32_t before = find(brick - step);
    if (before != kNoBrick) neighbours_[before][static_cast<std::size_t>(n)] = number;
  }
  return number;
}

std::uint32_t BrickTopology::find(const glm::ivec3& brick) const {
  if (slots_.empty()) return kNoBrick;
  const Slot& slot = slots_[slot_of(brick_of_voxel(brick))];
  if (slot.index == kNoTile) return kNoBrick;
  return tiles_[slot.index][static_cast<std::size_t>(offset_in_brick(brick))];
}

void BrickFinder::go_to_tile(const glm::ivec3& tile) {
  tile_ = tile;
  numbers_ = nullptr;
  if (topology_.slots_.empty()) return;
  const BrickTopology::Slot& slot = topology_.slots_[topology_.slot_of(tile)];
  if (slot.index != BrickTopology::kNoTile) numbers_ = &topology_.tiles_[slot.index];
}

std::size_t BrickTopology::memory_bytes() const {
  return slots_.capacity() * sizeof(Slot) + tiles_.capacity() * sizeof(Tile) +
         coordinates_.capacity() * sizeof(glm::ivec3) + neighbours_.capacity() * sizeof(Neighbours);
}

namespace {

template <class T>
void validate_view(const BrickView<const T>& grid) {
  if (!grid.topology) throw UsageError("a view of a grid needs a topology");
  if (grid.n_channels < 1) {
    throw UsageError("a grid needs at least 1 channel, found " + std::to_string(grid.n_channels));
  }
  if (!(grid.transform.voxel_size_m > 0.0) || !std::isfinite(grid.transform.voxel_size_m)) {
    throw UsageError("a grid's voxel size must be positive, found " +
                     format("%.6g m", grid.transform.voxel_size_m));
  }
  const std::size_t expected =
      grid.topology->n_bricks() * kBrickVoxels * static_cast<std::size_t>(grid.n_channels);
  if (grid.values.size() != expected) {
    throw UsageError("a grid of " + std::to_string(grid.topology->n_bricks()) +
                     " bricks of 512 voxels and " + std::to_string(grid.n_channels) +
                     " channels needs " + std::to_string(expected) + " values, found " +
                     std::to_string(grid.values.size()));
  }
}

}  // namespace

void validate(const BrickView<const float>& grid) { validate_view(grid); }
void validate(const BrickView<const double>& grid) { validate_view(grid); }

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

}  // namespace sarnerf
