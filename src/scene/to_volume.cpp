// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "vdb_grids.h"

namespace sarnerf {
namespace {

glm::ivec3 coordinates(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

/// Grids whose voxels answer or absorb: where they are, bricks must be.
std::vector<const openvdb::FloatGrid*> matter(const VdbScene::Grids& grids) {
  std::vector<const openvdb::FloatGrid*> found;
  for (const auto& grid : {grids.extinction, grids.extinction_back, grids.scattering}) {
    if (grid) found.push_back(grid.get());
  }
  return found;
}

/// Calls visit(brick) for each brick that active tiles or leaves of the grid touch.
template <class Visit>
void for_each_active_brick(const openvdb::FloatGrid& grid, Visit&& visit) {
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    if (!leaf->isEmpty()) visit(brick_of_voxel(coordinates(leaf->origin())));
  }
  auto tile = grid.tree().cbeginValueOn();
  tile.setMaxDepth(openvdb::FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const openvdb::CoordBBox box = tile.getBoundingBox();
    const glm::ivec3 low = brick_of_voxel(coordinates(box.min()));
    const glm::ivec3 high = brick_of_voxel(coordinates(box.max()));
    for (int x = low.x; x <= high.x; ++x) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int z = low.z; z <= high.z; ++z) visit(glm::ivec3(x, y, z));
      }
    }
  }
}

std::uint64_t count_bricks(const std::vector<const openvdb::FloatGrid*>& grids) {
  std::uint64_t largest = 0;
  for (const openvdb::FloatGrid* grid : grids) {
    const std::uint64_t tiles = grid->activeVoxelCount() / kBrickVoxels;
    largest = std::max<std::uint64_t>(largest, grid->tree().leafCount() + tiles);
  }
  return largest;
}

/// Copies one grid's values into a brick; `put(offset, value)` with offsets as in the grid's leaves.
template <class Tree, class Put>
void copy_brick(openvdb::tree::ValueAccessor<const Tree>& values, const glm::ivec3& brick, Put&& put) {
  const openvdb::Coord origin(brick.x * kBrickSide, brick.y * kBrickSide, brick.z * kBrickSide);
  if (const auto* leaf = values.probeConstLeaf(origin)) {
    for (openvdb::Index n = 0; n < kBrickVoxels; ++n) {
      if (leaf->isValueOn(n)) put(n, leaf->getValue(n));
    }
    return;
  }
  typename Tree::ValueType value;
  if (!values.probeValue(origin, value)) return;  // tiles are at least as large as a brick
  for (openvdb::Index n = 0; n < kBrickVoxels; ++n) put(n, value);
}

/// Where cells of eight voxels with a value in them reach: one voxel around those occupied.
Box support_of(const Volume& volume) {
  const BrickView<const float> view = volume.grid.view();
  const int first = 0, last = volume.channels.basis == SourceBasis::scattering
                                  ? volume.channels.count() - 1
                                  : volume.channels.first_source() - 1;
  glm::ivec3 low(std::numeric_limits<int>::max()), high(std::numeric_limits<int>::min());
  for (std::uint32_t brick = 0; brick < volume.grid.topology().n_bricks(); ++brick) {
    const glm::ivec3 origin = volume.grid.topology().coordinate(brick) * kBrickSide;
    for (int n = 0; n < kBrickVoxels; ++n) {
      const float* voxel = view.voxel(brick, n);
      if (std::none_of(voxel + first, voxel + last + 1, [](float v) { return v > 0.0f; })) continue;
      const glm::ivec3 at = origin + glm::ivec3(n >> 6, n >> 3 & 7, n & 7);
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
  }
  Box box;
  if (low.x > high.x) return box;
  box.include(volume.grid.transform().world_from_index(glm::dvec3(low) - 1.0));
  box.include(volume.grid.transform().world_from_index(glm::dvec3(high) + 1.0));
  return box;
}

}  // namespace

std::uint64_t Volume::memory_bytes() const {
  return grid.view().values.size_bytes() + grid.topology().memory_bytes() +
         component.size() * sizeof(Component);
}

Volume to_volume(const VdbScene& scene, std::uint64_t max_memory_bytes) {
  const VdbScene::Grids& grids = scene.grids();
  const auto with_matter = matter(grids);
  if (with_matter.empty()) throw InputError("the volume has neither extinction nor scattering");

  Volume volume;
  volume.channels = {grids.extinction_back != nullptr, grids.harmonics_degree, grids.basis};
  const auto n_channels = static_cast<std::size_t>(volume.channels.count());
  const std::uint64_t expected =
      count_bricks(with_matter) * kBrickVoxels * (n_channels * sizeof(float) + 1) * 5 / 4;
  if (max_memory_bytes > 0 && expected > max_memory_bytes) {
    throw UsageError("the volume's voxels need about " + std::to_string(expected >> 20) +
                     " MiB, more than the " + std::to_string(max_memory_bytes >> 20) +
                     " MiB allowed; use larger voxels or raise --max-memory");
  }
  volume.grid = BrickGrid<float>(
      grid_transform(with_matter.front()->transform(), with_matter.front()->getName()),
      volume.channels.count());

  // What surrounds matter belongs to its cells of eight voxels. Attributes reach two voxels beyond matter,
  // so that their bricks are all that such cells need.
  BrickTopology wanted;
  for (const openvdb::FloatGrid* grid : with_matter) {
    for_each_active_brick(*grid, [&](const glm::ivec3& brick) { wanted.insert(brick); });
  }
  if (!grids.brightness.empty()) {
    const std::uint32_t n_matter = static_cast<std::uint32_t>(wanted.n_bricks());
    BrickTopology attributes;
    for_each_active_brick(*grids.brightness.front(),
                          [&](const glm::ivec3& brick) { attributes.insert(brick); });
    for (std::uint32_t b = 0; b < attributes.n_bricks(); ++b) {
      // A brick of attributes alone matters only beside matter.
      const glm::ivec3 at = attributes.coordinate(b);
      bool beside = false;
      for (int n = 0; n < 27 && !beside; ++n) {
        const std::uint32_t near = wanted.find(at + glm::ivec3(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1));
        beside = near < n_matter;
      }
      if (beside) wanted.insert(at);
    }
  }
  // In the order of space, so that neighbours are neighbours in memory, too, whatever the file's order.
  std::vector<glm::ivec3> bricks;
  for (std::uint32_t b = 0; b < wanted.n_bricks(); ++b) bricks.push_back(wanted.coordinate(b));
  std::sort(bricks.begin(), bricks.end(), [](const glm::ivec3& a, const glm::ivec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  });
  for (const glm::ivec3& brick : bricks) volume.grid.touch_brick(brick);
  if (grids.component) volume.component.assign(bricks.size() * kBrickVoxels, Component::none);

  const BrickView<float> view = volume.grid.view();
  const auto fill = [&](std::size_t begin, std::size_t end, int) {
    // Accessors remember where they were: one each for every worker.
    const auto copy_floats = [&](const openvdb::FloatGrid::Ptr& grid, int channel) {
      if (!grid) return;
      openvdb::tree::ValueAccessor<const openvdb::FloatTree> values(grid->constTree());
      for (std::size_t b = begin; b < end; ++b) {
        copy_brick(values, bricks[b], [&](openvdb::Index n, float value) {
          view.voxel(static_cast<std::uint32_t>(b), static_cast<int>(n))[channel] = value;
        });
      }
    };
    copy_floats(grids.extinction, 0);
    copy_floats(grids.extinction_back, 1);
    int channel = volume.channels.first_source();
    copy_floats(grids.scattering, channel);
    for (const auto& coefficient : grids.brightness) copy_floats(coefficient, channel++);
    if (grids.normal) {
      openvdb::tree::ValueAccessor<const openvdb::Vec3STree> values(grids.normal->constTree());
      for (std::size_t b = begin; b < end; ++b) {
        copy_brick(values, bricks[b], [&](openvdb::Index n, const openvdb::Vec3s& value) {
          float* voxel = view.voxel(static_cast<std::uint32_t>(b), static_cast<int>(n)) + channel;
          for (int axis = 0; axis < 3; ++axis) voxel[axis] = value[axis];
        });
      }
      copy_floats(grids.exponent, channel + 3);
    }
    if (grids.component) {
      openvdb::tree::ValueAccessor<const openvdb::Int32Tree> values(grids.component->constTree());
      for (std::size_t b = begin; b < end; ++b) {
        copy_brick(values, bricks[b], [&](openvdb::Index n, std::int32_t value) {
          volume.component[b * kBrickVoxels + n] = static_cast<Component>(std::clamp(value, 0, 4));
        });
      }
    }
  };
  parallel_for(bricks.size(), 16, fill);

  for (const openvdb::FloatGrid* grid : with_matter) {
    volume.n_occupied_voxels = std::max(volume.n_occupied_voxels, grid->activeVoxelCount());
  }
  volume.support_m = support_of(volume);
  volume.box_m = scene.scene_box_m;
  if (volume.box_m.empty() && !volume.support_m.empty()) {
    const double voxel_m = volume.grid.transform().voxel_size_m;
    volume.box_m = {volume.support_m.min + voxel_m, volume.support_m.max - voxel_m};
  }
  return volume;
}

}  // namespace sarnerf
