// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include "sarnerf/bake/carved_solid.h"

namespace sarnerf {

/// What carved_solid() leaves: 1 in full voxels, 0 in empty ones, voxel (0, 0, 0) in the box's lowest corner. Leaves
/// without any full voxel are not there, full ones are active tiles.
openvdb::FloatGrid::Ptr carved_occupancy(std::span<const PosedImage> images, const CarvingLattice& lattice,
                                         std::optional<double> ground_height_m, const Monitor& monitor);

}  // namespace sarnerf
