// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <string>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// Where a file's grid lies in the world: its voxels, after axes have been swapped and mirrored, are those of
/// a lattice along the world's axes.
struct VdbPlacement {
  /// New index along n = sign[n] · old index along axis[n], + kMirror where the sign is negative.
  std::array<int, 3> axis{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};
  GridTransform transform;  ///< of the new indices, world metres, Y up

  /// Mirrored indices are moved by this much, one less than the largest nodes' side: every leaf and tile of
  /// a tree then falls onto one of the new tree.
  static constexpr int kMirror = 4095;

  bool moves_voxels() const { return *this != identity(transform); }
  bool operator==(const VdbPlacement& other) const { return axis == other.axis && sign == other.sign; }
  static VdbPlacement identity(const GridTransform& transform) { return {{0, 1, 2}, {1, 1, 1}, transform}; }
};

/// Placement of a grid of a file with this axis up and so many metres to a unit. Throws InputError unless the
/// transform is a uniform scale, swapped and mirrored axes, and a translation.
VdbPlacement placement_of(const openvdb::math::Transform& transform, UpAxis up, double metres_per_unit,
                          const std::string& where);

/// Whether voxels of both lie at the same places: within a millionth of a voxel.
bool same_lattice(const VdbPlacement& a, const VdbPlacement& b);

/// Gives the grid its place: swaps and mirrors its voxels where that is needed, and sets the transform.
/// Throws InputError when voxels lie beyond what bricks can hold. Cost: a copy of the grid, if voxels move.
void place_grid(openvdb::FloatGrid::Ptr& grid, const VdbPlacement& placement, const std::string& where);
void place_grid(openvdb::Vec3SGrid::Ptr& grid, const VdbPlacement& placement, const std::string& where);
void place_grid(openvdb::Int32Grid::Ptr& grid, const VdbPlacement& placement, const std::string& where);

/// Turns vectors from a frame with Z up into the world: (x, y, z) → (x, z, −y).
void turn_vectors_from_z_up(openvdb::Vec3SGrid& grid);

}  // namespace sarnerf
