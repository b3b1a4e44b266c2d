// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <optional>
#include <span>

#include "return_map.h"

namespace sarnerf {

/// The body behind the surfaces that views see, by what they agree on (view_agreement.h).
///
/// 0.5 lies on the surface, and values fall from 1 to 0 within a voxel to either side of it, so that a mesh is smoother
/// than voxels. Below `floor_m` (relative to the aim point) nothing is full. Grid coordinates are those of the lattice;
/// insides are tiles; points that no view's map holds are empty. Cost: some 30 ns a view and voxel near the surface and where
/// views differ; elsewhere one of 64 voxels is tested.
openvdb::FloatGrid::Ptr solid_occupancy(std::span<const ReturnMap> maps, double agreeing_share, const Occupancy& matter,
                                        const GridTransform& of_matter, const VoxelLattice& lattice,
                                        std::optional<double> floor_m, const Monitor& monitor);

/// Height (relative to the aim point) at which what stands there ends below, as far as it is seen: where the power that
/// comes from a layer falls below half of that from the five voxels above it. Nothing where nothing returns power.
std::optional<double> bottom_of_returns_m(std::span<const ReturnMap> maps, double voxel_m);

/// Matter itself: 0.5 where the volume's extinction is `threshold` (1/m), in proportion to it between 0 and 1.
openvdb::FloatGrid::Ptr shell_occupancy(const LearnedVolume& volume, double threshold_per_m,
                                        std::optional<double> floor_m);

}  // namespace sarnerf
