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

/// A scene as sparse voxels, in the form that renderers sample: bricks that store all channels of a voxel
/// next to each other. to_volume() makes it from OpenVDB grids.
struct Volume {
  BrickGrid<float> grid{GridTransform{}, 1};  ///< transform in world coordinates
  FieldChannels channels;
  std::vector<Component> component;  ///< per voxel, in the order of the grid's values; empty: unknown
  Box box_m;      ///< of the original scene, to frame the image; if unknown, of the occupied voxels' centres
  Box support_m;  ///< bounds the region where interpolated extinction or scattering is not 0
  /// Longest segment of a ray through the volume, in voxels. 0.5 unless the file states another length: the field is linear
  /// over shorter segments. Learned volumes state the segment length of their training, to which their values belong.
  double longest_segment = 0.5;
  std::uint64_t n_occupied_voxels = 0;  ///< with extinction or scattering

  std::uint64_t memory_bytes() const;
};

/// One grid of a VdbScene, for listings.
struct VdbGridSummary {
  std::string name, type;
  std::uint64_t n_active_voxels = 0;  ///< including those of active tiles
  std::uint64_t memory_bytes = 0;
  Box box_m;  ///< of the active voxels' faces; empty if no voxel is active
};

/// Contents of a VdbScene, for listings and --explain.
struct VdbSummary {
  double voxel_size_m = 0.0;
  std::vector<VdbGridSummary> grids;
  std::vector<std::pair<std::string, std::string>> metadata;  ///< of the file, sorted by name
};

/// A scene as OpenVDB grids (docs/guide/volumes.md): extinction, and scattering or brightness with its
/// attributes. Movable.
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

  /// Adds an entry to the file's metadata: provenance, integrator, reference bin. write_vdb() overwrites the
  /// entries of docs/guide/volumes.md that it sets itself.
  void set_metadata(const std::string& name, const std::string& value);
  void set_metadata(const std::string& name, double value);

  /// World box of the scene that the voxels were made from; empty if unknown.
  Box scene_box_m;

  bool is_fog = false;  ///< read from another tool's fog volume, by VdbReadOptions::extinction_per_density

  /// Assumptions made while reading, for the log: one line each.
  std::vector<std::string> notes;

 private:
  std::unique_ptr<Grids> grids_;
};

struct VdbReadOptions {
  UpAxis up = UpAxis::y;  ///< of files that do not state their up axis
  double units_m = 1.0;   ///< metres per unit of files that do not state their unit
  /// Extra factor on all lengths. Extinction and scattering of our own volumes are divided by it, so that
  /// optical depths do not change and opaque material stays opaque.
  double scale = 1.0;
  /// For fog volumes made by other tools: one-way extinction (1/m) of density 1.
  double extinction_per_density = 1.0;
  /// For the same: scattering P over one-way extinction; at 1 the material scatters all power that it removes
  /// from a ray, equally in all directions.
  double albedo = 1.0;
  std::uint64_t max_memory_bytes = 0;  ///< of the file and its grids together; 0: unlimited
  Monitor monitor;
};

/// Reads our own volumes exactly, and fog volumes and level sets of other tools with the assumptions that
/// `notes` lists; docs/guide/volumes.md has the rules. The resulting grids are in world metres with Y up: files
/// with Z up and grids with swapped or mirrored axes are converted voxel by voxel.
///
/// The file's structure is checked byte by byte before OpenVDB reads it, so that a damaged or hostile file
/// neither crashes the program nor makes it allocate more than its voxels need. Throws InputError with file,
/// grid and reason for anything that is not such a volume; UsageError, before allocating, if file and grids
/// need more memory than allowed; Interrupted. Cost: that of OpenVDB's own reading, one thread.
VdbScene read_vdb(const std::filesystem::path& path, const VdbReadOptions& options);

/// Writes all grids and their metadata, zip-compressed, to a temporary file beside `path` and renames it. The
/// same scene gives the same bytes with the same releases of OpenVDB and zlib: OpenVDB's random identifier is
/// replaced by a digest of the content. Throws Error with the path if the disk fails.
void write_vdb(const VdbScene& scene, const std::filesystem::path& path);

/// Copies the grids into bricks; values of active voxels do not change. Keeps bricks with extinction or
/// scattering above 0, and those neighbours whose attributes are used in interpolation. Active tiles, such as
/// the interiors of clouds, become voxels.
///
/// Throws UsageError, with a voxel size that would fit, before allocating more than allowed (0: unlimited);
/// Interrupted. Cost: linear in voxels, on all threads of parallel_for.
Volume to_volume(const VdbScene& scene, std::uint64_t max_memory_bytes = 0,
                 const Monitor& monitor = {});

/// A scene without a mesh for a volume: the volume's box, to frame the image, and the ground of `options`.
/// Throws UsageError for an unknown or translucent ground material, as load_scene() does.
Scene scene_around(const Volume& volume, const std::filesystem::path& file, const LoadOptions& options);

struct VoxeliseOptions {
  double voxel_size_m = 0.0;            ///< > 0
  std::uint64_t max_memory_bytes = 0;   ///< 0: unlimited
  Monitor monitor;
};

/// Turns the mesh of a scene into the sparse grids of docs/guide/volumes.md; the ground plane stays a plane.
///
/// CGAL computes inside, outside, distance and nearest triangle. Opaque material: a shell from 0.14 to three
/// voxels below its surface, with the extinction of vdb_grids.h; brightness, normals and exponents are those
/// of the nearest point of the surface, at least two voxels beyond the shell. Thin sheets are thickened until
/// they are opaque, at most to two voxels, and so are pieces smaller than two voxels; a sheet with one hidden
/// side gets a shell on that side instead. Translucent solids: extinction times the fraction of the voxel that
/// they cover; where solids overlap, their extinctions add. The basis is `cosine` with any opaque material
/// (translucent material has exponent 0), else `scattering`.
///
/// Throws UsageError, before allocating, if expected_voxel_memory_bytes() exceeds the limit; Interrupted on
/// request. Cost: proportional to the surface area over the voxel's square, some microseconds a voxel, on all
/// threads of parallel_for. Interiors of translucent solids are filled brick by brick and become tiles at the end.
VdbScene voxelise(const Scene& scene, const VoxeliseOptions& options);

/// Bytes that voxelise() is expected to need at its peak, from the area of all surfaces and the volume of translucent solids.
std::uint64_t expected_voxel_memory_bytes(const Scene& scene, double voxel_size_m);

}  // namespace sarnerf
