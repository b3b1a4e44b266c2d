// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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
  /// Of the brightness that voxels have by their coefficients, from what the field itself has there: root of the mean
  /// square over that of the field, weighted by extinction. 0 where coefficients are the field's own.
  double harmonics_residual = 0.0;

  Occupancy occupancy() const { return Occupancy(grid.view(), 1); }
};

/// Which voxels are wanted.
struct VoxelLattice {
  GridTransform transform;  ///< relative to the aim point
  glm::ivec3 first{0}, last{-1};

  bool holds(const glm::ivec3& voxel) const {
    return glm::all(glm::greaterThanEqual(voxel, first)) && glm::all(glm::lessThanEqual(voxel, last));
  }
};

/// The field's own voxels.
LearnedVolume native_volume(const GridField& field);

/// Another volume's values at the lattice's places, interpolated; bricks without extinction are left out. Throws
/// UsageError before allocating more than `max_memory_bytes` (0: unlimited). Cost: some 60 ns a voxel of bricks that
/// hold matter, in parallel.
LearnedVolume resampled(const LearnedVolume& volume, const VoxelLattice& lattice, std::uint64_t max_memory_bytes,
                        const Monitor& monitor);

/// A network's extinction at the lattice's places, and harmonics of degree 2 fitted to its brightness in directions
/// spread over those of the views, by least squares. Where two-way optical depth per reference bin is below 0.01 nothing
/// is kept. Throws as resampled(). Cost: one evaluation of the network a voxel that the field's lattice counts as occupied,
/// and one for each of 12 directions where there is matter.
LearnedVolume sampled(const MlpField& field, const VoxelLattice& lattice, std::span<const Acquisition> views,
                      std::uint64_t max_memory_bytes, const Monitor& monitor);

/// Channels of what sampled() gives.
FieldChannels sampled_channels();

/// Of so many bricks (bytes).
std::uint64_t volume_bytes(std::size_t n_bricks, const FieldChannels& channels);

/// Bricks of a lattice, ascending, in which some place lies in an occupied cell.
std::vector<glm::ivec3> bricks_with_matter(const Occupancy& occupancy, const GridTransform& of_occupancy,
                                           const VoxelLattice& lattice);

/// A volume on the lattice with these bricks, zero everywhere. Throws UsageError where it needs more than allowed, held
/// twice: as bricks, and as the grids that are made of them.
LearnedVolume empty_volume(const VoxelLattice& lattice, const FieldChannels& channels, std::span<const glm::ivec3> bricks,
                           std::uint64_t max_memory_bytes);

/// What return_maps() of a box (in the frame of the views' aim points) holds for so many views, with the lists of returns
/// that are made of them.
std::uint64_t return_map_bytes(std::span<const Acquisition> views, const Box& box_m, double spacing_m);

/// What such maps leave of the memory that is allowed; 0 where all is (0: unlimited). Throws UsageError where they leave
/// nothing.
std::uint64_t memory_beside_maps(std::span<const Acquisition> views, const Box& box_m, double spacing_m,
                                 std::uint64_t max_memory_bytes);

/// Names of the grids that volume_grids() makes.
std::vector<std::string> grid_names(const FieldChannels& channels);

/// The volume as grids of docs/guide/volumes.md, an active voxel for each with extinction or brightness. `in_world`: the
/// transform of all of them, the occupancy's too, which is given it here. `as_half`: brightness is written with 11 bits, in
/// half the time; for volumes that were interpolated anyhow.
VdbScene volume_grids(const LearnedVolume& volume, const GridTransform& in_world,
                      const openvdb::FloatGrid::Ptr& occupancy, bool as_half);

/// Adds to the volume's metadata what it was made from and how.
void describe(VdbScene& volume, const Model& model, const ExtractOptions& options, const Extraction& extraction);

}  // namespace sarnerf
