// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "voxel_surface.h"

namespace sarnerf {

/// Finds the sides of a sheet's triangles that are hidden from everywhere above the horizon by the scene's
/// opaque matter: rays into some directions from some points of each side, all of which meet something.
/// The front is the side that the normal points to. Cost: some fifty microseconds a triangle.
std::vector<HiddenSide> find_hidden_sides(const Scene& scene, const VoxelSurface& sheet,
                                          double voxel_size_m, const Monitor& monitor);

}  // namespace sarnerf
