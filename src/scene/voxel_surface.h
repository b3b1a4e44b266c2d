// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/surface_distance.h"

namespace sarnerf {

/// Which side of a sheet no radar above the horizon sees. There its matter can be put, so that the other side
/// answers where it is.
enum class HiddenSide : std::uint8_t { none, front, back };

/// A part of the mesh that is voxelised at one go: a closed piece, or all matter that is thinner than
/// voxels can tell.
struct VoxelSurface {
  std::vector<std::uint32_t> triangles;  ///< of the scene, by the surface's own numbers
  std::unique_ptr<SurfaceDistance> distance;
  bool closed = false;  ///< else a sheet, without an inside
  const Material* medium = nullptr;  ///< null: opaque
  std::vector<HiddenSide> hidden;    ///< of a sheet, per triangle
};

/// Cuts the scene's mesh into surfaces: one for each closed piece, one for all open opaque pieces together
/// with those too small for `voxel_size_m`. Open translucent pieces bound nothing and are left out.
std::vector<VoxelSurface> make_voxel_surfaces(const Scene& scene, double voxel_size_m,
                                              const Monitor& monitor);

}  // namespace sarnerf
