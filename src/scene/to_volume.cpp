// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include "brick_selection.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "text.h"

namespace sarnerf {
namespace {

/// What a file may ask for as the longest segment, in voxels.
constexpr double kShortestSegment = 0.1, kLongestSegment = 2.0;

/// Memory of a volume before it is made.
class VolumeBudget {
 public:
  VolumeBudget(const VdbScene::Grids& grids, int n_channels, double voxel_size_m, std::uint64_t limit_bytes)
      // The index, its tiles of 8³ bricks, and the lists of bricks while they are sorted.
      : bytes_per_brick_(kBrickVoxels * (sizeof(float) * static_cast<std::size_t>(n_channels) +
                                         (grids.component ? sizeof(Component) : 0)) + 256),
        n_channels_(n_channels),
        voxel_size_m_(voxel_size_m),
        limit_bytes_(limit_bytes) {}

  void require(std::uint64_t n_bricks) const {
    const double needed = double(bytes_per_brick_) * double(n_bricks);
    if (limit_bytes_ > 0 && needed > double(limit_bytes_)) {
      // Surfaces shrink with the square of the voxel size, and solids faster.
      const double fits = voxel_size_m_ * 1.05 * std::sqrt(needed / double(limit_bytes_));
      throw UsageError("the volume as " + counted(n_bricks, "brick", "bricks") + " of 8 x 8 x 8 voxels with " +
                       counted(static_cast<std::uint64_t>(n_channels_), "number", "numbers") +
                       " each needs about " + human_bytes(static_cast<std::uint64_t>(needed)) +
                       " of memory, but --max-memory allows " + human_bytes(limit_bytes_) +
                       ", enough with voxels of " + rounded(fits) + " m instead of " +
                       number_text(voxel_size_m_) + " m; raise it or use larger voxels");
    }
    if (n_bricks >= kNoBrick) {
      throw UsageError("expected fewer than 2^32 bricks of voxels, found " + with_thousands(n_bricks) +
                       "; use larger voxels");
    }
  }

 private:
  /// Upwards, to two digits.
  static std::string rounded(double value) {
    const double digit = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
    return number_text(static_cast<double>(static_cast<float>(std::ceil(value / digit) * digit)));
  }

  std::uint64_t bytes_per_brick_;
  int n_channels_;
  double voxel_size_m_;
  std::uint64_t limit_bytes_;
};

/// Calls put(offset, value) for the active voxels of one brick, offsets as in the grid's leaves.
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
    auto values = grid->getConstAccessor();  // remembers where it was: one for each thread
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

/// Cells of eight voxels reach one voxel around those occupied.
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
  // In the order of space, whatever the file's, so that neighbours are neighbours in memory, too.
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
