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
#include "vdb/vdb_grids.h"

namespace sarnerf {

class SurfaceField;  // sarnerf/nerf/surface_field.h, which needs LibTorch

/// Bricks of the lattice that meet the field's, in which its distance is known: the only ones in which a level set needs voxels,
/// since all others are far inside or outside of the body.
std::vector<glm::ivec3> bricks_of_surface(const SurfaceField& field, const VoxelLattice& lattice);

/// Names of the grids that surface_grids() makes, and the memory (bytes) that it may need for so many bricks.
std::vector<std::string> surface_grid_names();
std::uint64_t surface_grid_bytes(std::size_t n_bricks);

/// The distance of a SurfaceField as a level set on a lattice: interpolated between the field's voxels, and cut off below `floor_m`
/// (relative to the aim point) and at the lattice's ends. `in_world`: its transform. Throws UsageError before surface_grids()
/// would need more than `max_memory_bytes` (0: unlimited); Interrupted. Cost: some 50 ns a voxel of the bricks.
openvdb::FloatGrid::Ptr surface_distance(const SurfaceField& field, const VoxelLattice& lattice, const GridTransform& in_world,
                                         std::optional<double> floor_m, std::uint64_t max_memory_bytes, const Monitor& monitor);

/// Where a level set is 0, as level_surface(), without the components of which no view sees anything: islands in shadow, and
/// cavities. The vertices that no view sees are marked (SurfaceMesh::unseen).
struct Contour {
  SurfaceMesh mesh;
  std::size_t n_components = 0;  ///< as contoured
  std::size_t n_unseen = 0;      ///< of them, those that were removed
};

/// `views` in the frame of the grid. Throws Interrupted. Cost: up to a ray a vertex and view.
Contour contour(const openvdb::FloatGrid& distance, std::span<const Acquisition> views, const Monitor& monitor);

/// The body with its unseen parts closed by a membrane. What no view sees is as large as views allow: below an object, the cone
/// of its shadow. Instead, the unseen vertices of its `contour` move to the mean of their neighbours, while seen ones stay
/// (discrete harmonic surface: a flat one over a flat border, as small as possible nearly). The body is the
/// intersection of both, so that nothing that views have seen to be empty is filled. Components that were removed from the
/// contour are not part of it. Cost: conjugate gradients over the unseen vertices, and a distance transform of the mesh.
openvdb::FloatGrid::Ptr close_unseen(const openvdb::FloatGrid& distance, const SurfaceMesh& contour);

/// A body as grids of docs/guide/volumes.md: the level set `distance`, the opaque solid inside of it with the brightness and the
/// exponent of the field (basis `cosine`), `occupancy`, and `unseen`, which marks the contour's vertices. Where the field has no
/// albedo, since no ray came near, its mean is taken. Cost: some 50 ns a voxel.
VdbScene surface_grids(const SurfaceField& field, const VoxelLattice& lattice, const openvdb::FloatGrid::Ptr& distance,
                       const SurfaceMesh& contour);

}  // namespace sarnerf
