// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/bake/extract.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/vdb_scene.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

class GridField;  // sarnerf/nerf/grid_field.h and mlp_field.h, which need LibTorch
class MlpField;

/// A learned field as voxels: κ (1/m) and coefficients γ_lm of the brightness, in world axes centred on the aim point.
struct LearnedVolume {
  BrickGrid<float> grid{GridTransform{}, 1};
  FieldChannels channels;
  /// Relative error of the coefficients' brightness against the field's: root mean square of the difference over that of
  /// the field, weighted by extinction. 0 if the coefficients are the field's own.
  double harmonics_residual = 0.0;

  Occupancy occupancy() const { return Occupancy(grid.view(), 1); }
};

/// The voxels `first` to `last`, inclusive, of a lattice.
struct VoxelLattice {
  GridTransform transform;  ///< relative to the aim point
  glm::ivec3 first{0}, last{-1};

  bool holds(const glm::ivec3& voxel) const {
    return glm::all(glm::greaterThanEqual(voxel, first)) && glm::all(glm::lessThanEqual(voxel, last));
  }
};

/// The field's own voxels.
LearnedVolume native_volume(const GridField& field);

/// A volume's values interpolated at the lattice's voxels; bricks without occupied cells are left out. Throws
/// UsageError before allocating more than `max_memory_bytes` (0: unlimited). Cost: some 60 ns a voxel of these bricks,
/// in parallel.
LearnedVolume resampled(const LearnedVolume& volume, const VoxelLattice& lattice, std::uint64_t max_memory_bytes,
                        const Monitor& monitor);

/// A network's extinction at the lattice's voxels, and harmonics of degree 2 fitted to its brightness in directions
/// spread over those of the views, by least squares. Voxels whose two-way optical depth per reference bin is below 0.01 are
/// left empty. Throws as resampled(). Cost: one evaluation of the network for each voxel in an occupied cell of the field's
/// cache, and one in each of 12 directions for each that is kept.
LearnedVolume sampled(const MlpField& field, const VoxelLattice& lattice, std::span<const Acquisition> views,
                      std::uint64_t max_memory_bytes, const Monitor& monitor);

/// Channels of the volume that sampled() returns.
FieldChannels sampled_channels();

/// Memory of so many bricks (bytes).
std::uint64_t volume_bytes(std::size_t n_bricks, const FieldChannels& channels);

/// Throws UsageError if `needed` bytes are more than allowed (0: unlimited). The message states which voxels would do.
void require_memory(std::uint64_t needed, double voxel_size_m, std::uint64_t max_memory_bytes);

/// Bricks of a lattice, ascending, in which some voxel lies in an occupied cell.
std::vector<glm::ivec3> bricks_with_matter(const Occupancy& occupancy, const GridTransform& of_occupancy,
                                           const VoxelLattice& lattice);

/// A volume on the lattice with these bricks, zero everywhere. Throws UsageError if it needs more memory than
/// allowed, counted twice: as bricks, and as the grids that are made of them.
LearnedVolume empty_volume(const VoxelLattice& lattice, const FieldChannels& channels, std::span<const glm::ivec3> bricks,
                           std::uint64_t max_memory_bytes);

/// Names of the grids that volume_grids() makes.
std::vector<std::string> grid_names(const FieldChannels& channels);

/// The volume as grids of docs/guide/volumes.md; voxels with extinction or brightness are active. `in_world`: the
/// transform of all grids, which the occupancy is given here. `as_half`: brightness is written with 11 bits, in
/// half the time; for volumes that were interpolated anyway.
VdbScene volume_grids(const LearnedVolume& volume, const GridTransform& in_world,
                      const openvdb::FloatGrid::Ptr& occupancy, bool as_half);

/// Occupancy by extinction: 0.5 at `threshold_per_m`, proportional to the extinction between 0 and 1. Below `floor_m` (relative to
/// the aim point) it is 0.
openvdb::FloatGrid::Ptr occupancy_above(const LearnedVolume& volume, double threshold_per_m, std::optional<double> floor_m);

/// Adds to the volume's metadata what it was made from and how.
void describe(VdbScene& volume, const Model& model, const ExtractOptions& options, const Extraction& extraction);

}  // namespace sarnerf
