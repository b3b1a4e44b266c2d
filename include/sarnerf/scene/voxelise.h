// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

struct VoxeliseOptions {
  double voxel_size_m = 0.0;            ///< > 0
  std::uint64_t max_memory_bytes = 0;   ///< 0: unlimited
  Monitor monitor;
};

/// Turns the mesh of a scene into the sparse grids of docs/volumes.md; the ground plane stays a plane.
///
/// CGAL decides inside, outside, distance and nearest triangle. Opaque matter: a shell around its surface,
/// half a voxel to three voxels deep, with the extinction of opaque_transfer.h; brightness, normals and
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
