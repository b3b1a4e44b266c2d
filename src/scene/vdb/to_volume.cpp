// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <bitset>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

namespace {

/// Bricks of a volume, and their number of occupied voxels (with extinction or scattering).
struct BrickSelection {
  std::vector<glm::ivec3> bricks;  ///< in the order of x, then y, then z
  std::uint64_t n_occupied_voxels = 0;
  glm::ivec3 lowest{0}, highest{0};  ///< of the occupied voxels, inclusive; undefined if there is none
};

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

/// The grids of extinction and scattering.
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

/// For each step to a neighbour, the voxels of a brick (by offset) that cells of this neighbour use: along each
/// axis the last voxel for a step of +1, the first for −1, all for 0.
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

/// Whether a grid of the source has values in a brick. The grids differ little, but another tool may have pruned
/// each of them differently.
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

/// Results of one thread.
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

/// Number of bricks that active tiles of extinction or scattering above 0 become, the largest of all grids. Used
/// to refuse a volume before anything is allocated. Cost: linear in tiles.
std::uint64_t count_tile_bricks(const VdbScene::Grids& grids) {
  std::uint64_t largest = 0;
  for (const openvdb::FloatGrid* grid : matter_of(grids)) {
    std::uint64_t n = 0;
    for_each_tile(*grid, [&](const openvdb::CoordBBox& box) { n += box.volume() / kBrickVoxels; });
    largest = std::max(largest, n);
  }
  return largest;
}

/// Selects bricks with an active voxel or tile in which extinction or scattering is above 0, and their neighbours
/// if a cell of eight voxels with such a voxel reaches them and the source has values there. Throws InputError
/// for voxels beyond the largest index of bricks. Cost: linear in leaves and in the bricks of tiles, on all
/// threads except for sorting.
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

/// Limits of the longest segment that a file may set, in voxels.
constexpr double kShortestSegment = 0.1, kLongestSegment = 2.0;

/// Checks the memory of a volume before it is allocated.
class VolumeBudget {
 public:
  VolumeBudget(const VdbScene::Grids& grids, int n_channels, double voxel_size_m, std::uint64_t limit_bytes)
      // 256: the index, its tiles of 8³ bricks, and the lists of bricks while they are sorted.
      : bytes_per_brick_(kBrickVoxels * (sizeof(float) * static_cast<std::size_t>(n_channels) +
                                         (grids.component ? sizeof(Component) : 0)) + 256),
        n_channels_(n_channels),
        voxel_size_m_(voxel_size_m),
        limit_bytes_(limit_bytes) {}

  void require(std::uint64_t n_bricks) const {
    const double needed = double(bytes_per_brick_) * double(n_bricks);
    if (limit_bytes_ > 0 && needed > double(limit_bytes_)) {
      // The number of bricks falls with the square of the voxel size for surfaces, and faster for solids.
      const double fits = voxel_size_m_ * 1.05 * std::sqrt(needed / double(limit_bytes_));
      throw UsageError("the volume as " + counted(n_bricks, "brick", "bricks") + " of 8 x 8 x 8 voxels with " +
                       counted(static_cast<std::uint64_t>(n_channels_), "number", "numbers") +
                       " each needs about " + human_bytes(static_cast<std::uint64_t>(needed)) +
                       " of memory, and " + human_bytes(limit_bytes_) +
                       " are available (--max-memory), enough with voxels of " + rounded(fits) + " m instead of " +
                       number_text(voxel_size_m_) + " m; raise it or use larger voxels");
    }
    if (n_bricks >= kNoBrick) {
      throw UsageError("expected fewer than 2^32 bricks of voxels, found " + with_thousands(n_bricks) +
                       "; use larger voxels");
    }
  }

 private:
  /// Rounds up to two digits.
  static std::string rounded(double value) {
    const double digit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
    return number_text(static_cast<double>(static_cast<float>(std::ceil(value / digit) * digit)));
  }

  std::uint64_t bytes_per_brick_;
  int n_channels_;
  double voxel_size_m_;
  std::uint64_t limit_bytes_;
};

/// Calls put(offset, value) for the active voxels of one brick; offsets are those of the grid's leaves.
template <class Accessor, class Put>
void for_each_value(Accessor& values, const glm::ivec3& brick, Put&& put) {
  const openvdb::Coord origin(brick.x * kBrickSide, brick.y * kBrickSide, brick.z * kBrickSide);
  if (const auto* leaf = values.probeConstLeaf(origin)) {
    for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel) put(static_cast<int>(voxel.pos()), *voxel);
    return;
  }
  typename Accessor::ValueType value;
  if (!values.probeValue(origin, value)) return;  // tiles are at least as large as a brick
  for (int n = 0; n < kBrickVoxels; ++n) put(n, value);
}

/// Copies grids into bricks [begin, end) of a volume, one grid after the other.
class BrickFiller {
 public:
  BrickFiller(Volume& volume, std::size_t begin, std::size_t end)
      : volume_(volume), view_(volume.grid.view()), begin_(begin), end_(end) {}

  void fill(const VdbScene::Grids& grids) {
    copy(grids.extinction, 0);
    copy(grids.extinction_back, 1);
    int channel = volume_.channels.first_source();
    copy(grids.scattering, channel);
    for (const auto& coefficient : grids.brightness) copy(coefficient, channel++);
    each(grids.normal, [&](std::uint32_t brick, int n, const openvdb::Vec3s& value) {
      float* voxel = view_.voxel(brick, n) + channel;
      for (int axis = 0; axis < 3; ++axis) voxel[axis] = value[axis];
    });
    copy(grids.exponent, channel + 3);
    each(grids.component, [&](std::uint32_t brick, int n, std::int32_t value) {
      volume_.component[std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(n)] =
          static_cast<Component>(value);
    });
  }

 private:
  template <class Pointer, class Put>
  void each(const Pointer& grid, Put&& put) {
    if (!grid) return;
    auto values = grid->getConstAccessor();  // caches its position: one for each thread
    for (std::size_t b = begin_; b < end_; ++b) {
      const auto brick = static_cast<std::uint32_t>(b);
      for_each_value(values, volume_.grid.topology().coordinate(brick),
                     [&](int n, const auto& value) { put(brick, n, value); });
    }
  }

  void copy(const openvdb::FloatGrid::Ptr& grid, int channel) {
    each(grid, [&](std::uint32_t brick, int n, float value) { view_.voxel(brick, n)[channel] = value; });
  }

  Volume& volume_;
  BrickView<float> view_;
  std::size_t begin_, end_;
};

/// Cells of eight voxels extend one voxel beyond the occupied voxels.
Box support_of(const BrickSelection& selection, const GridTransform& transform) {
  Box box;
  if (selection.n_occupied_voxels == 0) return box;
  box.include(transform.world_from_index(glm::dvec3(selection.lowest) - 1.0));
  box.include(transform.world_from_index(glm::dvec3(selection.highest) + 1.0));
  return box;
}

}  // namespace

std::uint64_t Volume::memory_bytes() const {
  return grid.view().values.size_bytes() + grid.topology().memory_bytes() +
         component.size() * sizeof(Component);
}

Volume to_volume(const VdbScene& scene, std::uint64_t max_memory_bytes, const Monitor& monitor) {
  const VdbScene::Grids& grids = scene.grids();
  require_complete(grids);
  const openvdb::FloatGrid& matter = grids.extinction ? *grids.extinction : *grids.scattering;
  const GridTransform transform = grid_transform(matter.transform(), "grid " + in_quotes(matter.getName()));

  Volume volume;
  volume.channels = {grids.extinction_back != nullptr, grids.harmonics_degree, grids.basis};
  const VolumeBudget budget(grids, volume.channels.count(), transform.voxel_size_m, max_memory_bytes);
  budget.require(count_tile_bricks(grids));
  monitor.check();
  const BrickSelection selection = select_bricks(grids);
  budget.require(selection.bricks.size());

  volume.grid = BrickGrid<float>(transform, volume.channels.count());
  volume.grid.reserve_bricks(selection.bricks.size());
  // In spatial order instead of the file's, so that neighbours are close in memory too.
  for (const glm::ivec3& brick : selection.bricks) volume.grid.touch_brick(brick);
  const std::size_t n_bricks = selection.bricks.size();
  if (grids.component) volume.component.assign(n_bricks * kBrickVoxels, Component::none);
  volume.n_occupied_voxels = selection.n_occupied_voxels;
  volume.support_m = support_of(selection, transform);
  if (const auto longest = grids.metadata.getMetadata<openvdb::DoubleMetadata>("longest_segment_voxels");
      longest && std::isfinite(longest->value())) {
    volume.longest_segment = std::clamp(longest->value(), kShortestSegment, kLongestSegment);
  }
  volume.box_m = scene.scene_box_m;
  if (volume.box_m.empty() && !volume.support_m.empty()) {
    volume.box_m = {volume.support_m.min + transform.voxel_size_m,
                    volume.support_m.max - transform.voxel_size_m};
  }

  std::atomic<std::uint64_t> n_done{0};
  parallel_for(n_bricks, 256, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    BrickFiller(volume, begin, end).fill(grids);
    const std::uint64_t done = n_done += end - begin;
    if (worker == 0) monitor.report("filling bricks", done, n_bricks);
  });
  return volume;
}

}  // namespace sarnerf
