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
  /// `max_memory_bytes`: limit for the file's bytes and all grids loaded by this object; 0: unlimited. The file
  /// must outlive this object.
  VdbGridLoader(const VdbFile& file, std::uint64_t max_memory_bytes, const Monitor& monitor);

  /// The grid as stored in the file: values, transform, name and class. `GridType`: FloatGrid, Vec3SGrid or
  /// Int32Grid. Throws InputError for a grid of another type or a damaged one; UsageError beyond the limit.
  template <class GridType>
  typename GridType::Ptr load(const VdbFileGrid& grid);

  /// Counts memory for data derived from a grid; throws UsageError beyond the limit.
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

/// "float", "double", "vec3s", … from a tree's type, for messages.
std::string vdb_type_words(const std::string& type);

/// Position of a file's grid in the world: after axes have been swapped and mirrored, its voxels are those of a
/// lattice along the world's axes.
struct VdbPlacement {
  /// New index along n = sign[n] · old index along axis[n], + kMirror where the sign is negative.
  std::array<int, 3> axis{0, 1, 2};
  std::array<int, 3> sign{1, 1, 1};
  GridTransform transform;  ///< of the new indices, world metres, Y up

  /// Offset of mirrored indices, one less than the side of the largest nodes: every leaf and tile of the old tree
  /// then coincides with one of the new tree.
  static constexpr int kMirror = 4095;

  bool moves_voxels() const { return *this != identity(transform); }
  bool operator==(const VdbPlacement& other) const { return axis == other.axis && sign == other.sign; }
  static VdbPlacement identity(const GridTransform& transform) { return {{0, 1, 2}, {1, 1, 1}, transform}; }
};

/// Placement of a grid from a file with the given up axis and unit. Throws InputError unless the transform
/// consists of a uniform scale, swapped and mirrored axes, and a translation.
VdbPlacement placement_of(const openvdb::math::Transform& transform, UpAxis up, double metres_per_unit,
                          const std::string& where);

/// Whether the voxels of both lie at the same positions, within a millionth of a voxel.
bool same_lattice(const VdbPlacement& a, const VdbPlacement& b);

/// Applies a placement: swaps and mirrors the grid's voxels if needed, and sets the transform. Throws InputError
/// for voxels beyond the largest index of bricks. Cost: a copy of the grid, if voxels move.
void place_grid(openvdb::FloatGrid::Ptr& grid, const VdbPlacement& placement, const std::string& where);
void place_grid(openvdb::Vec3SGrid::Ptr& grid, const VdbPlacement& placement, const std::string& where);
void place_grid(openvdb::Int32Grid::Ptr& grid, const VdbPlacement& placement, const std::string& where);

/// Turns vectors from a frame with Z up into the world: (x, y, z) → (x, z, −y).
void turn_vectors_from_z_up(openvdb::Vec3SGrid& grid);

enum class ValueRule {
  finite,
  not_negative,  ///< and finite
};

/// Throws InputError unless the background is 0 and every active value, multiplied by `factor`, satisfies the
/// rule; reports how many do not, and the first of them. `where` names file and grid. All threads.
void require_values(const openvdb::FloatGrid& grid, ValueRule rule, double factor, const std::string& where);
/// Throws InputError unless every active value is finite. For distances, whose background is not 0.
void require_finite_distances(const openvdb::FloatGrid& grid, const std::string& where);
/// The same as require_values() for vectors, which must be finite, and for components, 0 to 4.
void require_vectors(const openvdb::Vec3SGrid& grid, const std::string& where);
void require_components(const openvdb::Int32Grid& grid, const std::string& where);

/// Multiplies every value, active or not. All threads.
void multiply_values(openvdb::FloatGrid& grid, double factor);

}  // namespace sarnerf

/// Interpretation of a file's grids, for the two kinds of files: ours and those of other tools.
namespace sarnerf {

/// State of reading one file.
struct VdbReading {
  VdbGridLoader& loader;
  const VdbReadOptions& options;
  std::vector<std::string>& notes;
  Box& scene_box_m;  ///< stays empty if the file does not state it
  bool is_fog = false;  ///< see VdbScene::is_fog

  const VdbFile& file() const { return loader.file(); }
  std::string place(const VdbFileGrid& grid) const;
};

/// Reads a file by the names and metadata of docs/guide/volumes.md.
std::unique_ptr<VdbScene::Grids> read_own_layout(VdbReading& reading);
/// Whether a file declares our format, or has grids of those names from any writer.
bool has_own_layout(const VdbFile& file);

/// Reads a fog volume or a level set of another tool.
std::unique_ptr<VdbScene::Grids> read_foreign_layout(VdbReading& reading);

/// "extinction (float, fog volume), v (vec3s, unknown)"; "none" when the file has no grid.
std::string listed_grids(const VdbFile& file);

}  // namespace sarnerf

namespace sarnerf {

/// read_vdb() for a file's bytes; `name` appears in messages.
VdbScene read_vdb_bytes(std::string_view bytes, const std::string& name, const VdbReadOptions& options);

}  // namespace sarnerf
