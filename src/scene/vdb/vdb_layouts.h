// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/vdb_scene.h"
#include "vdb/vdb_file.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

/// Loads grids of a scanned file, within a memory limit.
class VdbGridLoader {
 public:
  /// `max_memory_bytes` for the file's bytes and all grids loaded by this object; 0: unlimited. The file must
  /// outlive it.
  VdbGridLoader(const VdbFile& file, std::uint64_t max_memory_bytes, const Monitor& monitor);

  /// The grid as it is in the file: values, transform, name and class. `GridType`: FloatGrid, Vec3SGrid or
  /// Int32Grid. Throws InputError for a grid of another type or a damaged one; UsageError beyond the limit.
  template <class GridType>
  typename GridType::Ptr load(const VdbFileGrid& grid);

  /// Counts memory that is to be made of a grid; throws UsageError beyond the limit.
  void require_memory(const VdbFileGrid& grid, std::uint64_t more_bytes);

  const VdbFile& file() const { return file_; }
  const Monitor& monitor() const { return monitor_; }

 private:
  openvdb::GridBase::Ptr load_as(const VdbFileGrid& grid, openvdb::GridBase::Ptr empty, int n_components);

  const VdbFile& file_;
  std::uint64_t max_memory_bytes_;
  std::uint64_t used_bytes_;
  const Monitor& monitor_;
};

/// "float", "double", "vector", … for messages, from a tree's type.
std::string vdb_type_words(const std::string& type);

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

enum class ValueRule {
  finite,
  not_negative,  ///< and finite
};

/// Throws InputError unless the background is 0 and every active value, multiplied by `factor`, keeps the
/// rule; says how many do not, and the first of them. `where` names file and grid. All threads.
void require_values(const openvdb::FloatGrid& grid, ValueRule rule, double factor, const std::string& where);
/// Throws InputError unless every active value is finite; for distances, whose background is not 0.
void require_finite_distances(const openvdb::FloatGrid& grid, const std::string& where);
/// The same as require_values() for vectors, which must be finite, and for components, 0 to 4.
void require_vectors(const openvdb::Vec3SGrid& grid, const std::string& where);
void require_components(const openvdb::Int32Grid& grid, const std::string& where);

/// Multiplies every value, active or not. All threads.
void multiply_values(openvdb::FloatGrid& grid, double factor);

}  // namespace sarnerf

/// What grids of a file mean, for the two kinds of files: ours and those of other tools.
namespace sarnerf {

/// One file while it is read.
struct VdbReading {
  VdbGridLoader& loader;
  const VdbReadOptions& options;
  std::vector<std::string>& notes;
  Box& scene_box_m;  ///< stays empty where the file does not say

  const VdbFile& file() const { return loader.file(); }
  std::string place(const VdbFileGrid& grid) const;
};

/// The names and the metadata of docs/guide/volumes.md.
std::unique_ptr<VdbScene::Grids> read_own_layout(VdbReading& reading);
/// Whether a file has grids by those names, whoever wrote it.
bool has_own_layout(const VdbFile& file);

/// A fog volume or a level set.
std::unique_ptr<VdbScene::Grids> read_foreign_layout(VdbReading& reading);

/// "extinction (float, fog volume), v (vec3s, unknown)"; "none" when the file has no grid.
std::string listed_grids(const VdbFile& file);

}  // namespace sarnerf

namespace sarnerf {

/// read_vdb() of a file's bytes; `name` is what messages call it.
VdbScene read_vdb_bytes(std::string_view bytes, const std::string& name, const VdbReadOptions& options);

}  // namespace sarnerf
