// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// A scene as sparse voxels, in the form that renderers sample: bricks with all channels of a voxel side
/// by side. Made from OpenVDB grids by to_volume().
struct Volume {
  BrickGrid<float> grid{GridTransform{}, 1};  ///< transform in world coordinates
  FieldChannels channels;
  std::vector<Component> component;  ///< per voxel, in the order of the grid's values; empty: unknown
  Box box_m;      ///< of what the voxels were made from, to be framed; else of the voxels that are occupied
  Box support_m;  ///< where interpolated extinction or scattering is not 0
  /// Of segments of rays through it, in voxels. Half of one unless the file says otherwise: the field is linear over less
  /// than that. Learned volumes are what their training's segments saw.
  double longest_segment = 0.5;
  std::uint64_t n_occupied_voxels = 0;  ///< with extinction or scattering

  std::uint64_t memory_bytes() const;
};

/// One grid of a VdbScene, for listings.
struct VdbGridSummary {
  std::string name, type;
  std::uint64_t n_active_voxels = 0;  ///< those of active tiles too
  std::uint64_t memory_bytes = 0;
  Box box_m;  ///< of the active voxels, faces included; empty when there is none
};

/// What a VdbScene holds, for listings and --explain.
struct VdbSummary {
  double voxel_size_m = 0.0;
  std::vector<VdbGridSummary> grids;
  std::vector<std::pair<std::string, std::string>> metadata;  ///< of the file, in the order of names
};

/// A scene as OpenVDB grids (docs/guide/volumes.md): extinction, and scattering or brightness with what
/// belongs to it. Movable.
class VdbScene {
 public:
  struct Grids;

  VdbScene();  ///< without grids
  explicit VdbScene(std::unique_ptr<Grids> grids);
  ~VdbScene();
  VdbScene(VdbScene&&) noexcept;
  VdbScene& operator=(VdbScene&&) noexcept;

  const Grids& grids() const { return *grids_; }
  Grids& grids() { return *grids_; }

  double voxel_size_m() const;

  /// Cost: linear in the nodes of all grids.
  VdbSummary summary() const;

  /// Adds to what the file says about itself: provenance, integrator, reference bin. The names of
  /// docs/guide/volumes.md that write_vdb() sets itself are overruled by it.
  void set_metadata(const std::string& name, const std::string& value);
  void set_metadata(const std::string& name, double value);

  /// World box of what the voxels were made from; empty when that is not known.
  Box scene_box_m;

  /// What reading assumed, for the log: one line each.
  std::vector<std::string> notes;

 private:
  std::unique_ptr<Grids> grids_;
};

struct VdbReadOptions {
  UpAxis up = UpAxis::y;  ///< of files that do not say
  double units_m = 1.0;   ///< metres per unit of files that do not say
  /// Extra factor on all lengths. Extinction and scattering of our own volumes are divided by it, so that
  /// optical depths stay: opaque matter must stay opaque.
  double scale = 1.0;
  /// Of fog volumes made by other tools: one-way extinction (1/m) of density 1.
  double extinction_per_density = 1.0;
  /// Of the same: scattering P over one-way extinction; 1 is matter that scatters all that it takes out
  /// of a ray, equally in all directions.
  double albedo = 1.0;
  std::uint64_t max_memory_bytes = 0;  ///< of the file and its grids together; 0: unlimited
  Monitor monitor;
};

/// Reads our own volumes exactly, and fog volumes and level sets of other tools with the assumptions that
/// `notes` state; docs/guide/volumes.md has the rules. The grids of the result are in world metres with Y up: a
/// file with Z up, and axes that are swapped or mirrored, are brought there voxel by voxel.
///
/// The file's structure is checked byte by byte before OpenVDB sees it, so that a damaged or hostile file
/// neither crashes nor allocates more than its voxels need. Throws InputError with file, grid and reason
/// for anything that is not such a volume; UsageError, before allocating, when file and grids need more
/// than allowed; Interrupted. Cost: that of OpenVDB's own reading, one thread.
VdbScene read_vdb(const std::filesystem::path& path, const VdbReadOptions& options);

/// Writes all grids and their metadata, zip-compressed, beside and renamed. The same scene gives the same
/// bytes with the same releases of OpenVDB and zlib: OpenVDB's random identifier is replaced by one made
/// of the content. Throws Error with the path when the disk fails.
void write_vdb(const VdbScene& scene, const std::filesystem::path& path);

/// The grids as bricks, every active voxel as it is. Kept are bricks with extinction or scattering above 0,
/// and those neighbours of theirs whose attributes interpolation reaches. Active tiles, such as the insides
/// of clouds, become voxels.
///
/// Throws UsageError before allocating more than allowed (0: unlimited), with a voxel size that would fit;
/// Interrupted. Cost: linear in voxels, on all threads of parallel_for.
Volume to_volume(const VdbScene& scene, std::uint64_t max_memory_bytes = 0,
                 const Monitor& monitor = {});

/// A scene without a mesh around a volume: its box to be framed, and the ground that `options` ask for.
/// Throws as load_scene() for materials that are not known.
Scene scene_around(const Volume& volume, const std::filesystem::path& file, const LoadOptions& options);

struct VoxeliseOptions {
  double voxel_size_m = 0.0;            ///< > 0
  std::uint64_t max_memory_bytes = 0;   ///< 0: unlimited
  Monitor monitor;
};

/// Turns the mesh of a scene into the sparse grids of docs/guide/volumes.md; the ground plane stays a plane.
///
/// CGAL decides inside, outside, distance and nearest triangle. Opaque matter: a shell around its surface,
/// half a voxel to three voxels deep, with the extinction of voxel_brick.h; brightness, normals and
/// exponents are those of the nearest point of the surface, two voxels beyond the matter. Thin sheets are
/// thickened until they are opaque, at most to two voxels, and so are pieces smaller than two voxels.
/// Translucent solids: extinction times the part of the voxel that they cover; where solids overlap their
/// extinctions add. With opaque matter the basis is `cosine` (translucent matter has exponent 0), without
/// it `scattering`.
///
/// Throws UsageError before allocating more than allowed, Interrupted on request. Cost: proportional to
/// the surface over the voxel's square, some microseconds a voxel, on all threads of parallel_for; the
/// interiors of translucent solids are tiles.
VdbScene voxelise(const Scene& scene, const VoxeliseOptions& options);

/// Bytes that voxelise() is expected to need at its peak, from the mesh's surface alone.
std::uint64_t expected_voxel_memory_bytes(const Scene& scene, double voxel_size_m);

}  // namespace sarnerf
