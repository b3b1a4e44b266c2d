// SPDX-License-Identifier: Apache-2.0
#include "vdb_values.h"

#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/scene/component.h"
#include "text.h"

namespace sarnerf {
namespace {

constexpr std::size_t kLeavesPerChunk = 64;

std::string value_text(float value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "infinite" : "minus infinity";
  return number_text(double{value});
}
std::string value_text(std::int32_t value) { return std::to_string(value); }
std::string value_text(const openvdb::Vec3s& value) {
  return "(" + value_text(value[0]) + ", " + value_text(value[1]) + ", " + value_text(value[2]) + ")";
}

/// Offences of a grid. The first is that of the lowest coordinates, whatever the threads do.
template <class Value>
struct Offences {
  std::uint64_t count = 0;
  openvdb::Coord first;
  Value value{};

  void add(const openvdb::Coord& at, const Value& found, std::uint64_t n = 1) {
    if (count == 0 || at < first) {
      first = at;
      value = found;
    }
    count += n;
  }
  void add(const Offences& other) {
    if (other.count > 0) add(other.first, other.value, other.count);
  }
};

template <class Grid, class Good>
void require_all(const Grid& grid, const std::string& where, const char* expected, const Good& good) {
  using Tree = typename Grid::TreeType;
  Offences<typename Grid::ValueType> offences;
  std::mutex mutex;
  const openvdb::tree::LeafManager<const Tree> leaves(grid.constTree());
  parallel_for(leaves.leafCount(), kLeavesPerChunk, [&](std::size_t begin, std::size_t end, int) {
    Offences<typename Grid::ValueType> found;
    for (std::size_t n = begin; n < end; ++n) {
      for (auto voxel = leaves.leaf(n).cbeginValueOn(); voxel; ++voxel) {
        if (!good(*voxel)) found.add(voxel.getCoord(), *voxel);
      }
    }
    const std::lock_guard lock(mutex);
    offences.add(found);
  });
  auto tile = grid.constTree().cbeginValueOn();
  tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!good(*tile)) offences.add(tile.getBoundingBox().min(), *tile, tile.getVoxelCount());
  }
  if (offences.count == 0) return;
  const openvdb::Coord& at = offences.first;
  throw InputError(where + ": expected " + expected + ", found " +
                   counted(offences.count, "voxel that is", "voxels that are") +
                   " not, the first at index (" + std::to_string(at.x()) + ", " + std::to_string(at.y()) +
                   ", " + std::to_string(at.z()) + "): " + value_text(offences.value) +
                   "; mend the grid where it was made");
}

template <class Grid>
void require_background(const Grid& grid, const std::string& where) {
  if (grid.background() == openvdb::zeroVal<typename Grid::ValueType>()) return;
  throw InputError(where + ": expected 0 outside of the active voxels, found the background value " +
                   value_text(grid.background()) + "; write the grid with background 0");
}

}  // namespace

void require_values(const openvdb::FloatGrid& grid, ValueRule rule, double factor, const std::string& where) {
  require_background(grid, where);
  const auto by = static_cast<float>(factor);
  if (rule == ValueRule::finite) {
    return require_all(grid, where, "finite values", [=](float v) { return std::isfinite(v * by); });
  }
  require_all(grid, where, "finite values of at least 0",
              [=](float v) { return v >= 0.0f && std::isfinite(v * by); });
}

void require_finite_distances(const openvdb::FloatGrid& grid, const std::string& where) {
  require_all(grid, where, "finite distances", [](float v) { return std::isfinite(v); });
}

void require_vectors(const openvdb::Vec3SGrid& grid, const std::string& where) {
  require_background(grid, where);
  require_all(grid, where, "finite vectors", [](const openvdb::Vec3s& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  });
}

void require_components(const openvdb::Int32Grid& grid, const std::string& where) {
  require_background(grid, where);
  require_all(grid, where, "components 0 to 4", [](std::int32_t v) {
    return v >= 0 && v <= static_cast<std::int32_t>(Component::other);
  });
}

void multiply_values(openvdb::FloatGrid& grid, double factor) {
  const auto by = static_cast<float>(factor);
  openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grid.tree());
  parallel_for(leaves.leafCount(), kLeavesPerChunk, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      for (auto voxel = leaves.leaf(n).beginValueAll(); voxel; ++voxel) voxel.setValue(*voxel * by);
    }
  });
  auto tile = grid.tree().beginValueAll();
  tile.setMaxDepth(openvdb::FloatTree::ValueAllIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) tile.setValue(*tile * by);
  grid.tree().root().setBackground(grid.background() * by, false);
}

}  // namespace sarnerf
