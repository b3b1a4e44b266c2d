// SPDX-License-Identifier: Apache-2.0
#include "brick_selection.h"

#include <algorithm>
#include <bitset>
#include <mutex>
#include <tuple>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

using FloatAccessor = openvdb::FloatGrid::ConstAccessor;
using Occupied = std::bitset<kBrickVoxels>;

glm::ivec3 coordinates(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

openvdb::Coord first_voxel(const glm::ivec3& brick) {
  return {brick.x * kBrickSide, brick.y * kBrickSide, brick.z * kBrickSide};
}

bool in_order(const glm::ivec3& a, const glm::ivec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

void sort_once(std::vector<glm::ivec3>& bricks) {
  std::sort(bricks.begin(), bricks.end(), in_order);
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
}

/// Grids whose voxels answer or absorb.
std::vector<const openvdb::FloatGrid*> matter_of(const VdbScene::Grids& grids) {
  std::vector<const openvdb::FloatGrid*> found;
  for (const auto& grid : {grids.extinction, grids.extinction_back, grids.scattering}) {
    if (grid) found.push_back(grid.get());
  }
  return found;
}

/// Calls visit(box) for the active tiles with a value above 0.
template <class Visit>
void for_each_tile(const openvdb::FloatGrid& grid, Visit&& visit) {
  auto tile = grid.constTree().cbeginValueOn();
  tile.setMaxDepth(openvdb::FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (*tile > 0.0f) visit(tile.getBoundingBox());
  }
}

/// Bricks of the grid's leaves and tiles that may be occupied.
void add_candidates(const openvdb::FloatGrid& grid, std::vector<glm::ivec3>& bricks) {
  for (auto leaf = grid.constTree().cbeginLeaf(); leaf; ++leaf) {
    if (!leaf->isEmpty()) bricks.push_back(brick_of_voxel(coordinates(leaf->origin())));
  }
  for_each_tile(grid, [&](const openvdb::CoordBBox& box) {
    const glm::ivec3 low = brick_of_voxel(coordinates(box.min()));
    const glm::ivec3 high = brick_of_voxel(coordinates(box.max()));
    for (int x = low.x; x <= high.x; ++x) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int z = low.z; z <= high.z; ++z) bricks.emplace_back(x, y, z);
      }
    }
  });
}

void add_occupied(FloatAccessor& values, const glm::ivec3& brick, Occupied& occupied) {
  const openvdb::Coord origin = first_voxel(brick);
  if (const auto* leaf = values.probeConstLeaf(origin)) {
    for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) {
      if (*voxel > 0.0f) occupied.set(voxel.pos());
    }
    return;
  }
  float value = 0.0f;
  if (values.probeValue(origin, value) && value > 0.0f) occupied.set();
}

/// Voxels, by their offset, that lie in the slab of a brick which cells of a neighbour reach: along each axis
/// the last voxel for a step of +1, the first for −1, all for 0.
std::array<Occupied, 27> make_slabs() {
  std::array<Occupied, 27> slabs;
  for (int step = 0; step < 27; ++step) {
    const glm::ivec3 to(step / 9 - 1, step / 3 % 3 - 1, step % 3 - 1);
    for (int n = 0; n < kBrickVoxels; ++n) {
      const glm::ivec3 at = voxel_in_brick(n);
      bool inside = true;
      for (int axis = 0; axis < 3; ++axis) {
        inside = inside && (to[axis] == 0 || at[axis] == (to[axis] > 0 ? kBrickSide - 1 : 0));
      }
      slabs[static_cast<std::size_t>(step)][static_cast<std::size_t>(n)] = inside;
    }
  }
  return slabs;
}

/// Whether the source has values anywhere in a brick. Its grids differ little, but a foreign file may have
/// pruned each of them in its own way.
bool has_source(const VdbScene::Grids& grids, const glm::ivec3& brick) {
  const openvdb::Coord origin = first_voxel(brick);
  const auto active = [&](const auto& grid) {
    if (!grid) return false;
    const auto* leaf = grid->constTree().probeConstLeaf(origin);
    return leaf ? !leaf->isEmpty() : grid->constTree().isValueOn(origin);
  };
  return std::any_of(grids.brightness.begin(), grids.brightness.end(), active) || active(grids.normal) ||
         active(grids.exponent);
}

void require_reach(const BrickSelection& selection) {
  for (int n = 0; n < 3; ++n) {
    for (const int brick : {selection.lowest[n] >> 3, selection.highest[n] >> 3}) {
      if (std::abs(brick) >= kMaxBrick) {
        throw InputError("expected voxels within index 2^30, found one in brick " + std::to_string(brick) +
                         "; move the volume's origin to its voxels");
      }
    }
  }
}

/// What one thread finds.
struct Found {
  std::vector<glm::ivec3> bricks, neighbours;
  std::uint64_t n_occupied = 0;
  glm::ivec3 lowest{std::numeric_limits<int>::max()}, highest{std::numeric_limits<int>::min()};
};

void look_at(const glm::ivec3& brick, const Occupied& occupied, const std::array<Occupied, 27>& slabs,
             Found& found) {
  if (occupied.none()) return;
  found.bricks.push_back(brick);
  found.n_occupied += occupied.count();
  const bool inside = glm::all(glm::lessThan(found.lowest, brick * kBrickSide)) &&
                      glm::all(glm::greaterThan(found.highest, brick * kBrickSide + (kBrickSide - 1)));
  for (std::size_t n = 0; n < kBrickVoxels && !inside; ++n) {
    if (!occupied[n]) continue;
    const glm::ivec3 at = brick * kBrickSide + voxel_in_brick(n);
    found.lowest = glm::min(found.lowest, at);
    found.highest = glm::max(found.highest, at);
  }
  for (int step = 0; step < 27; ++step) {
    if (step == 13 || (occupied & slabs[static_cast<std::size_t>(step)]).none()) continue;
    found.neighbours.push_back(brick + glm::ivec3(step / 9 - 1, step / 3 % 3 - 1, step % 3 - 1));
  }
}

}  // namespace

std::uint64_t count_tile_bricks(const VdbScene::Grids& grids) {
  std::uint64_t largest = 0;
  for (const openvdb::FloatGrid* grid : matter_of(grids)) {
    std::uint64_t n = 0;
    for_each_tile(*grid, [&](const openvdb::CoordBBox& box) { n += box.volume() / kBrickVoxels; });
    largest = std::max(largest, n);
  }
  return largest;
}

BrickSelection select_bricks(const VdbScene::Grids& grids) {
  const std::vector<const openvdb::FloatGrid*> matter = matter_of(grids);
  std::vector<glm::ivec3> candidates;
  for (const openvdb::FloatGrid* grid : matter) add_candidates(*grid, candidates);
  sort_once(candidates);

  static const std::array<Occupied, 27> slabs = make_slabs();
  Found all;
  std::mutex mutex;
  parallel_for(candidates.size(), 256, [&](std::size_t begin, std::size_t end, int) {
    Found found;
    std::vector<FloatAccessor> values;
    for (const openvdb::FloatGrid* grid : matter) values.emplace_back(grid->constTree());
    for (std::size_t n = begin; n < end; ++n) {
      Occupied occupied;
      for (FloatAccessor& grid : values) add_occupied(grid, candidates[n], occupied);
      look_at(candidates[n], occupied, slabs, found);
    }
    sort_once(found.neighbours);
    std::erase_if(found.neighbours, [&](const glm::ivec3& brick) { return !has_source(grids, brick); });
    const std::lock_guard lock(mutex);
    all.bricks.insert(all.bricks.end(), found.bricks.begin(), found.bricks.end());
    all.neighbours.insert(all.neighbours.end(), found.neighbours.begin(), found.neighbours.end());
    all.n_occupied += found.n_occupied;
    all.lowest = glm::min(all.lowest, found.lowest);
    all.highest = glm::max(all.highest, found.highest);
  });

  BrickSelection selection;
  selection.bricks = std::move(all.bricks);
  selection.bricks.insert(selection.bricks.end(), all.neighbours.begin(), all.neighbours.end());
  sort_once(selection.bricks);
  selection.n_occupied_voxels = all.n_occupied;
  if (selection.n_occupied_voxels == 0) return selection;
  selection.lowest = all.lowest;
  selection.highest = all.highest;
  require_reach(selection);
  return selection;
}

}  // namespace sarnerf
