// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/scene/vdb_scene.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <openvdb/tools/ValueTransformer.h>

#include "readers/scene_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "vdb/vdb_grids.h"
#include "vdb/vdb_layouts.h"

namespace sarnerf {

namespace {

constexpr double kTolerance = 1e-6;  // of a voxel
/// OpenVDB treats maps that shrink volumes by a factor below 3e-15 as singular.
constexpr double kSmallestVoxel_m = 2e-5;

glm::dvec3 world_from_file(const openvdb::Vec3d& p, UpAxis up, double metres_per_unit) {
  const glm::dvec3 q = up == UpAxis::y ? glm::dvec3(p.x(), p.y(), p.z()) : glm::dvec3(p.x(), p.z(), -p.y());
  return q * metres_per_unit;
}

openvdb::Coord moved(const openvdb::Coord& voxel, const VdbPlacement& placement) {
  openvdb::Coord result;
  for (int n = 0; n < 3; ++n) {
    const auto at = static_cast<std::size_t>(n);
    const int along = voxel[placement.axis[at]];
    result[n] = placement.sign[at] > 0 ? along : VdbPlacement::kMirror - along;
  }
  return result;
}

/// Low corner of a node after it is moved.
openvdb::Coord moved_node(const openvdb::Coord& low, int side, const VdbPlacement& placement) {
  const openvdb::Coord a = moved(low, placement);
  const openvdb::Coord b = moved(low.offsetBy(side - 1), placement);
  return openvdb::Coord::minComponent(a, b);
}

void require_reach(const openvdb::CoordBBox& box, const std::string& where) {
  // Leaves room for mirroring, and for the neighbours of the outermost voxels.
  constexpr int kReach = kBrickSide * (kMaxBrick - 2) - VdbPlacement::kMirror;
  for (int n = 0; n < 3; ++n) {
    if (box.min()[n] >= -kReach && box.max()[n] <= kReach) continue;
    throw InputError(where + ": expected voxels within index " + std::to_string(kReach) + ", found some from " +
                     std::to_string(box.min()[n]) + " to " + std::to_string(box.max()[n]) +
                     "; move the grid's origin to its voxels");
  }
}

template <class Grid>
typename Grid::Ptr moved_grid(const Grid& grid, const VdbPlacement& placement) {
  using Tree = typename Grid::TreeType;
  using Leaf = typename Tree::LeafNodeType;
  auto result = Grid::create(grid.background());
  result->insertMeta(grid);

  std::vector<const Leaf*> from;
  grid.constTree().getNodes(from);
  std::vector<std::unique_ptr<Leaf>> to(from.size());
  parallel_for(from.size(), 64, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      const openvdb::Coord low = from[n]->origin();
      to[n] = std::make_unique<Leaf>(moved_node(low, Leaf::DIM, placement), grid.background(), false);
      for (auto voxel = from[n]->cbeginValueAll(); voxel; ++voxel) {
        const openvdb::Index at = Leaf::coordToOffset(moved(voxel.getCoord(), placement));
        to[n]->setValueOnly(at, *voxel);
        if (voxel.isValueOn()) to[n]->setValueOn(at);
      }
    }
  });
  auto tile = grid.constTree().cbeginValueAll();
  tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    if (!tile.isValueOn() && *tile == grid.background()) continue;
    const openvdb::CoordBBox box = tile.getBoundingBox();
    result->tree().addTile(tile.getLevel(), moved_node(box.min(), box.dim().x(), placement), *tile,
                           tile.isValueOn());
  }
  for (auto& leaf : to) result->tree().addLeaf(leaf.release());
  return result;
}

template <class Pointer>
void place(Pointer& grid, const VdbPlacement& placement, const std::string& where) {
  require_reach(grid->evalActiveVoxelBoundingBox(), where);
  if (placement.moves_voxels()) grid = moved_grid(*grid, placement);
  grid->setTransform(vdb_transform(placement.transform));
}

}  // namespace

VdbPlacement placement_of(const openvdb::math::Transform& transform, UpAxis up, double metres_per_unit,
                          const std::string& where) {
  const auto refuse = [&](const std::string& found) {
    throw InputError(where + ": expected a transform of uniform scale, whole quarter turns and translation, found " +
                     found + "; resample the grid");
  };
  if (!transform.isLinear()) refuse("a perspective one");
  const auto image = [&](int axis) {
    openvdb::Vec3d p(0.0);
    if (axis < 3) p[axis] = 1.0;
    return world_from_file(transform.indexToWorld(p), up, metres_per_unit);
  };
  const glm::dvec3 origin = image(3);
  if (!std::isfinite(origin.x + origin.y + origin.z)) refuse("one that is not finite");
  VdbPlacement placement;
  std::array<double, 3> size{};
  std::array<bool, 3> taken{};
  for (int old = 0; old < 3; ++old) {
    const glm::dvec3 step = image(old) - origin;
    int along = 0;
    for (int n = 1; n < 3; ++n) {
      if (std::abs(step[n]) > std::abs(step[along])) along = n;
    }
    const auto at = static_cast<std::size_t>(along);
    const double length = std::abs(step[along]);
    if (!(length > 0.0) || !std::isfinite(length)) refuse("one without a size");
    // The differences contain the rounding error of a large translation.
    const double rounding = 1e-12 * (std::abs(origin.x) + std::abs(origin.y) + std::abs(origin.z));
    for (int n = 0; n < 3; ++n) {
      if (n != along && std::abs(step[n]) > kTolerance * length + rounding) refuse("a rotated or sheared one");
    }
    if (taken[at]) refuse("a sheared one");
    taken[at] = true;
    placement.axis[at] = old;
    placement.sign[at] = step[along] > 0.0 ? 1 : -1;
    size[static_cast<std::size_t>(old)] = length;
    if (std::abs(length - size[0]) > kTolerance * size[0] + rounding) {
      refuse("voxels of " + std::to_string(size[0]) + " by " + std::to_string(length) + " m");
    }
  }
  // The map's own voxel size is free of the translation's rounding error.
  const double voxel_m = transform.voxelSize().x() * metres_per_unit;
  const double farthest = std::max({std::abs(origin.x), std::abs(origin.y), std::abs(origin.z), voxel_m});
  if (!(voxel_m >= kSmallestVoxel_m) || !(farthest <= kFarthest_m)) {
    throw InputError(where + ": expected voxels of at least " + number_text(kSmallestVoxel_m) + " m within " +
                     number_text(kFarthest_m) + " m, found some of " + number_text(voxel_m) + " m from (" +
                     number_text(origin.x) + ", " + number_text(origin.y) + ", " + number_text(origin.z) +
                     ") on; choose other --units, or correct the grid's transform");
  }
  placement.transform = {origin, voxel_m};
  for (std::size_t n = 0; n < 3; ++n) {
    if (placement.sign[n] < 0) {
      placement.transform.origin_m[static_cast<int>(n)] -= voxel_m * VdbPlacement::kMirror;
    }
  }
  return placement;
}

bool same_lattice(const VdbPlacement& a, const VdbPlacement& b) {
  const double voxel_m = a.transform.voxel_size_m;
  if (!(a == b) || std::abs(b.transform.voxel_size_m - voxel_m) > 1e-9 * voxel_m) return false;
  for (int n = 0; n < 3; ++n) {
    const double at = a.transform.origin_m[n];
    if (std::abs(b.transform.origin_m[n] - at) > kTolerance * voxel_m + 1e-12 * std::abs(at)) return false;
  }
  return true;
}

void place_grid(openvdb::FloatGrid::Ptr& grid, const VdbPlacement& placement, const std::string& where) {
  place(grid, placement, where);
}
void place_grid(openvdb::Vec3SGrid::Ptr& grid, const VdbPlacement& placement, const std::string& where) {
  place(grid, placement, where);
}
void place_grid(openvdb::Int32Grid::Ptr& grid, const VdbPlacement& placement, const std::string& where) {
  place(grid, placement, where);
}

void turn_vectors_from_z_up(openvdb::Vec3SGrid& grid) {
  openvdb::tools::foreach(grid.beginValueAll(), [](const openvdb::Vec3SGrid::ValueAllIter& value) {
    const openvdb::Vec3s v = *value;
    value.setValue({v.x(), v.z(), -v.y()});
  });
}

Scene scene_around(const Volume& volume, const std::filesystem::path& file, const LoadOptions& options) {
  Scene scene;
  scene.box = volume.box_m;
  scene.report.files.push_back(file);
  MaterialLibrary materials;
  if (!options.materials_file.empty()) {
    materials.add_file(options.materials_file);
    scene.report.files.push_back(options.materials_file);
  }
  if (!options.ground_material || *options.ground_material == "none") return scene;
  scene.materials.push_back(materials.require_ground(*options.ground_material));
  const double lowest_m = scene.box.empty() ? 0.0 : scene.box.min.y;
  scene.ground = Ground{0, options.ground_height_m.value_or(lowest_m)};
  return scene;
}

}  // namespace sarnerf
