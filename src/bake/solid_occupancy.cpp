// SPDX-License-Identifier: Apache-2.0
#include "return_map.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <memory>

#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
static_assert(Leaf::DIM == kBrickSide);

/// Layers with less than this fraction of the median layer's power are stray. Faint walls under a bright roof have more.
constexpr double kStray = 0.02;

/// Voxels between the points of a leaf that are tested first.
constexpr int kStride = 4;

enum class State : std::uint8_t { empty, full, mixed };

/// Rises from 0 to 1 over two voxels; ½ at height 0.
float ramp(double height_m, double voxel_m) {
  return static_cast<float>(std::clamp(0.5 + 0.5 * height_m / voxel_m, 0.0, 1.0));
}

glm::dvec3 centre_m(const VoxelLattice& lattice, const glm::ivec3& voxel) {
  return lattice.transform.world_from_index(glm::dvec3(voxel));
}

float cut_by_floor(float value, double height_m, std::optional<double> floor_m, double voxel_m) {
  return floor_m ? std::min(value, ramp(height_m - *floor_m, voxel_m)) : value;
}

}  // namespace

openvdb::FloatGrid::Ptr solid_occupancy(std::span<const ReturnMap> maps, double agreeing_share, const Occupancy& matter,
                                        const GridTransform& of_matter, const VoxelLattice& lattice,
                                        std::optional<double> floor_m, const Monitor& monitor) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  if (maps.empty()) return grid;
  const double voxel_m = lattice.transform.voxel_size_m;
  const glm::ivec3 first = brick_of_voxel(lattice.first), n = brick_of_voxel(lattice.last) - first + 1;
  const auto n_z = static_cast<std::size_t>(n.z), n_yz = static_cast<std::size_t>(n.y) * n_z;
  const std::size_t n_leaves = static_cast<std::size_t>(n.x) * n_yz;
  const auto leaf_at = [&](std::size_t l) {
    return first + glm::ivec3(static_cast<int>(l / n_yz), static_cast<int>(l % n_yz / n_z), static_cast<int>(l % n_z));
  };

  // Occupied leaves are tested voxel by voxel; so are those whose corners and midpoints differ.
  std::vector<State> states(n_leaves, State::empty);
  for (const glm::ivec3& brick : bricks_with_matter(matter, of_matter, lattice)) {
    const glm::ivec3 at = brick - first;
    states[static_cast<std::size_t>(at.x) * n_yz + static_cast<std::size_t>(at.y) * n_z +
           static_cast<std::size_t>(at.z)] = State::mixed;
  }
  parallel_for(n_leaves, 64, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    ViewAgreement views(maps, agreeing_share, voxel_m);
    for (std::size_t l = begin; l < end; ++l) {
      if (states[l] == State::mixed) continue;
      int n_full = 0, n_empty = 0;
      for (int s = 0; s < 27 && (n_full == 0 || n_empty == 0); ++s) {
        const glm::ivec3 step(s / 9, s / 3 % 3, s % 3);
        const glm::dvec3 place = glm::dvec3(leaf_at(l) * kBrickSide) + double{kStride} * glm::dvec3(step) - 0.5;
        const float value = views.occupancy(lattice.transform.world_from_index(place));
        n_full += value >= 1.0f ? 1 : 0;
        n_empty += value <= 0.0f ? 1 : 0;
        if (value > 0.0f && value < 1.0f) ++n_full, ++n_empty;
      }
      states[l] = n_full > 0 && n_empty > 0 ? State::mixed : n_full > 0 ? State::full : State::empty;
    }
  });

  std::vector<std::unique_ptr<Leaf>> leaves(n_leaves);
  std::atomic<std::size_t> n_done = 0;
  parallel_for(n_leaves, 16, [&](std::size_t begin, std::size_t end, int worker) {
    monitor.check();
    ViewAgreement views(maps, agreeing_share, voxel_m);
    for (std::size_t l = begin; l < end; ++l) {
      if (states[l] == State::empty) continue;
      const glm::ivec3 origin = leaf_at(l) * kBrickSide;
      auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), 0.0f, false);
      for (int v = 0; v < kBrickVoxels; ++v) {
        const glm::ivec3 voxel = origin + voxel_in_brick(v);
        if (glm::any(glm::lessThan(voxel, lattice.first)) || glm::any(glm::greaterThan(voxel, lattice.last))) continue;
        const glm::dvec3 point_m = centre_m(lattice, voxel);
        const float height = cut_by_floor(1.0f, point_m.y, floor_m, voxel_m);
        if (height <= 0.0f) continue;
        const float value = std::min(height, states[l] == State::full ? 1.0f : views.occupancy(point_m));
        if (value > 0.0f) leaf->setValueOn(static_cast<openvdb::Index>(v), value);
      }
      if (!leaf->isEmpty()) leaves[l] = std::move(leaf);
    }
    const std::size_t done = n_done += end - begin;
    if (worker == 0) monitor.report("filling the body", done, n_leaves);
  });
  for (std::unique_ptr<Leaf>& leaf : leaves) {
    if (leaf == nullptr) continue;
    float value = 0.0f;
    bool active = false;
    if (leaf->isConstant(value, active)) {
      grid->tree().addTile(1, leaf->origin(), value, active);
    } else {
      grid->tree().addLeaf(leaf.release());
    }
  }
  return grid;
}

std::optional<double> bottom_of_returns_m(std::span<const ReturnMap> maps, double voxel_m) {
  std::vector<ReturnMap::Return> returns;
  for (const ReturnMap& map : maps) map.append_returns(returns);
  if (returns.empty()) return std::nullopt;
  const auto [low, high] =
      std::minmax_element(returns.begin(), returns.end(), [](const auto& a, const auto& b) { return a.point_m.y < b.point_m.y; });
  // Layers are half a voxel high. Above the last one lie as many empty ones as the window has.
  constexpr std::size_t kWindow = 10;
  const double layer_m = 0.5 * voxel_m, first_m = low->point_m.y;
  const auto n = static_cast<std::size_t>((high->point_m.y - first_m) / layer_m) + 1;
  std::vector<double> power(n + kWindow, 0.0);
  for (const auto& r : returns) power[static_cast<std::size_t>((r.point_m.y - first_m) / layer_m)] += double{r.power};
  std::vector<double> some;
  std::copy_if(power.begin(), power.end(), std::back_inserter(some), [](double p) { return p > 0.0; });
  const double least = kStray * median(some);
  const auto half_of_above = [&](std::size_t layer) {
    double sum = 0.0;
    for (std::size_t w = 1; w <= kWindow; ++w) sum += power[layer + w];
    return 0.5 * sum / kWindow;
  };
  for (std::size_t layer = 0; layer < n; ++layer) {
    const double half = half_of_above(layer);
    if (power[layer] < least || power[layer] < half) continue;
    // Interpolated between the middle of the layer below, whose power is less than half, and that of this one.
    const double before = layer > 0 ? power[layer - 1] : 0.0;
    const double part = power[layer] > before ? std::clamp((half - before) / (power[layer] - before), 0.0, 1.0) : 1.0;
    return first_m + layer_m * (static_cast<double>(layer) - 0.5 + part);
  }
  return first_m;
}

openvdb::FloatGrid::Ptr shell_occupancy(const LearnedVolume& volume, double threshold_per_m,
                                        std::optional<double> floor_m) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const BrickView<const float> view = volume.grid.view();
  const GridTransform& transform = volume.grid.transform();
  for (std::uint32_t b = 0; b < view.topology->n_bricks(); ++b) {
    const glm::ivec3 origin = view.topology->coordinate(b) * kBrickSide;
    auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), 0.0f, false);
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double height_m = transform.world_from_index(glm::dvec3(origin + voxel_in_brick(v))).y;
      const auto value = static_cast<float>(std::min(1.0, 0.5 * double{view.voxel(b, v)[0]} / threshold_per_m));
      const float left = cut_by_floor(value, height_m, floor_m, transform.voxel_size_m);
      if (left > 0.0f) leaf->setValueOn(static_cast<openvdb::Index>(v), left);
    }
    if (!leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
  }
  return grid;
}

}  // namespace sarnerf
