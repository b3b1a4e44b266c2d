// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace sarnerf {

/// Two-way optical depth of a voxel well inside opaque matter.
inline constexpr float kOpaqueDepthPerVoxel = 20.0f;

/// Depth (voxels) below a surface at which its matter begins to absorb. Interpolated between voxels, what
/// begins here answers a radar as if from depth 0 on average over all positions of the lattice, all
/// orientations and incidences up to 75°; the scatter about that is 0.15 voxels. Matter that began at the
/// surface itself would answer 0.14 voxels deep, coverage of a voxel by matter 0.64 voxels too early.
inline constexpr float kOpaqueOnset = 0.14f;

/// Depth (voxels) that the middle of a thin sheet is given whatever its thickness, so that less than 1e-5
/// of the power passes through it at any position of the lattice. A sheet answers up to this much early.
inline constexpr float kSheetDepth = 1.0f;

/// Two-way optical depth per voxel at a depth (voxels, inside positive) below the surface of opaque matter.
inline float opaque_extinction_per_voxel(float depth_in_voxels) {
  return kOpaqueDepthPerVoxel * std::clamp(depth_in_voxels - kOpaqueOnset, 0.0f, 1.0f);
}

/// Depth at which a point counts that lies `depth` (voxels) below a surface whose matter is `thickness`
/// (voxels) thick there: thin matter is thickened until it is opaque.
inline float thickened_depth(float depth_in_voxels, float thickness_in_voxels) {
  return depth_in_voxels + std::max(0.0f, kSheetDepth - 0.5f * thickness_in_voxels);
}

}  // namespace sarnerf
