// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "learned_volume.h"
#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

class SurfaceField;  // sarnerf/nerf/surface_field.h, which needs LibTorch

/// Bricks of the lattice that meet the field's, in which its distance is known.
std::vector<glm::ivec3> bricks_of_surface(const SurfaceField& field, const VoxelLattice& lattice);

/// Names of the grids that surface_grids() makes, and the memory (bytes) that it may need for so many bricks.
std::vector<std::string> surface_grid_names();
std::uint64_t surface_grid_bytes(std::size_t n_bricks);

/// The body of a SurfaceField on a lattice as grids of docs/guide/volumes.md: a level set `distance`, the opaque solid inside of
/// it with the brightness and the exponent of the field (basis `cosine`), and `occupancy`. The distance is interpolated between
/// the field's voxels. The body is cut off below `floor_m` (relative to the aim point) and at the lattice's ends. `in_world`: the
/// transform of all grids. Throws UsageError before allocating more than `max_memory_bytes` (0: unlimited); Interrupted. Cost:
/// some 0.1 µs a voxel of the bricks.
VdbScene surface_grids(const SurfaceField& field, const VoxelLattice& lattice, const GridTransform& in_world,
                       std::optional<double> floor_m, std::uint64_t max_memory_bytes, const Monitor& monitor);

/// Where the grid `distance` is 0, as level_surface(), without the components of which no view sees anything: islands in shadow,
/// and cavities. Marks the vertices that no view sees (SurfaceMesh::unseen), and adds the grid `unseen`.
struct Contour {
  SurfaceMesh mesh;
  std::size_t n_components = 0;  ///< as contoured
  std::size_t n_unseen = 0;      ///< of them, those that were removed
};

/// `views` in the frame of the grids. Throws Interrupted. Cost: up to a ray a vertex and view.
Contour contour(VdbScene& volume, std::span<const Acquisition> views, const Monitor& monitor);

}  // namespace sarnerf
