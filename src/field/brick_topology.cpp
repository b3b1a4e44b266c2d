// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/brick_topology.h"

#include <string>
#include <utility>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Neighbouring tiles differ in low bits only; multiplication carries them up, the shift back down.
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

}  // namespace sarnerf
