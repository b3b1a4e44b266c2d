// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/volume.h"

namespace sarnerf {

/// One grid of a VdbScene, for listings.
struct VdbGridSummary {
  std::string name, type;
  std::uint64_t n_active_voxels = 0;
  std::uint64_t memory_bytes = 0;
};

/// A scene as OpenVDB grids (docs/volumes.md): extinction, and scattering or brightness with what
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
  std::vector<VdbGridSummary> summary() const;

  /// World box of what the voxels were made from; empty when that is not known.
  Box scene_box_m;

  /// What reading assumed, for the log: one line each.
  std::vector<std::string> notes;

 private:
  std::unique_ptr<Grids> grids_;
};

struct VdbReadOptions {
  UpAxis up = UpAxis::y;   ///< of files that do not say
  double units_m = 1.0;    ///< metres per unit of files that do not say
  double scale = 1.0;      ///< extra factor on all lengths
  /// Of fog volumes made by other tools: one-way extinction (1/m) of density 1.
  double extinction_per_density = 1.0;
  std::uint64_t max_memory_bytes = 0;  ///< 0: unlimited
  Monitor monitor;
};

/// Reads our own volumes exactly, and fog volumes and level sets of other tools with the assumptions that
/// `notes` state. Throws InputError with file, grid and reason for anything else.
VdbScene read_vdb(const std::filesystem::path& path, const VdbReadOptions& options);

/// Writes all grids and their metadata, compressed, beside and renamed. The same scene gives the same
/// voxels; OpenVDB adds a random identifier to every file.
void write_vdb(const VdbScene& scene, const std::filesystem::path& path);

/// The grids as bricks, every voxel as it is. Active tiles, such as the insides of clouds, become voxels.
/// Throws UsageError before allocating more than allowed (0: unlimited). Cost: linear in voxels, on all
/// threads of parallel_for.
Volume to_volume(const VdbScene& scene, std::uint64_t max_memory_bytes = 0);

/// A scene without a mesh around a volume: its box to be framed, and the ground that `options` ask for.
/// Throws as load_scene() for materials that are not known.
Scene scene_around(const Volume& volume, const std::filesystem::path& file, const LoadOptions& options);

}  // namespace sarnerf
