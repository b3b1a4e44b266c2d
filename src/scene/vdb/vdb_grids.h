// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "sarnerf/field/field_sampler.h"
#include "sarnerf/scene/vdb_scene.h"

// OpenVDB's grid classes have hundreds of virtual functions each. Compiling them again in every unit took a third of the
// build time of scene; vdb_grids.cpp instantiates them once.
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::Vec3STree>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;

namespace sarnerf {

/// The grids of a VdbScene; null if the scene does not have the grid. All have the same transform (uniform scale
/// and translation), in world metres with Y up.
struct VdbScene::Grids {
  openvdb::FloatGrid::Ptr extinction;       ///< κ⁺ (1/m)
  openvdb::FloatGrid::Ptr extinction_back;  ///< κ⁻ (1/m), if it differs
  SourceBasis basis = SourceBasis::harmonics;
  int harmonics_degree = 0;
  openvdb::FloatGrid::Ptr scattering;               ///< P (1/m), for SourceBasis::scattering
  std::vector<openvdb::FloatGrid::Ptr> brightness;  ///< γ₀, or the coefficients γ_lm
  openvdb::Vec3SGrid::Ptr normal;                   ///< for SourceBasis::cosine
  openvdb::FloatGrid::Ptr exponent;                 ///< for SourceBasis::cosine
  openvdb::Int32Grid::Ptr component;                ///< optional, as enum Component
  openvdb::FloatGrid::Ptr distance;         ///< optional: signed distance from a body's surface (m), a level set
  openvdb::FloatGrid::Ptr unseen;           ///< optional: of surface voxels, 1 where no view sees them, else 0
  openvdb::FloatGrid::Ptr occupancy;        ///< optional: 0 outside a body, 1 inside; for tools that need its shape
  openvdb::MetaMap metadata;  ///< of the file; write_vdb() adds its own entries

  /// The grids that exist, in the order of the channels; those that are not rendered last.
  std::vector<openvdb::GridBase::Ptr> all() const;
};

/// Throws UsageError unless the grids that the basis needs exist, and no others.
void require_complete(const VdbScene::Grids& grids);

/// Transform of grids with voxel centres at `transform`'s integer indices.
openvdb::math::Transform::Ptr vdb_transform(const GridTransform& transform);
/// Inverse of vdb_transform(). Throws InputError unless the map is uniform scale and translation.
GridTransform grid_transform(const openvdb::math::Transform& transform, const std::string& where);

/// The opaque solid inside of a level set, whose distances have `units_per_voxel`: extinction from the depth below the surface,
/// γ₀ 1, exponent 1, and normals along the gradient of the distance, in the level set's active voxels.
std::unique_ptr<VdbScene::Grids> solid_grids(const openvdb::FloatGrid& distance, double units_per_voxel);

/// Two-way optical depth of a voxel well inside opaque material.
inline constexpr float kOpaqueDepthPerVoxel = 20.0f;

/// Depth (voxels) below a surface at which extinction begins. Extinction is interpolated between voxels; with this
/// onset the mean range of the backscatter is that of the surface (depth 0), averaged over all positions of the
/// lattice, all orientations and incidences up to 75°, with a scatter of 0.15 voxels. With an onset at the surface
/// itself the backscatter would come 0.14 voxels too early, with extinction by coverage of the voxel 0.64 voxels.
inline constexpr float kOpaqueOnset = 0.14f;

/// Two-way optical depth per voxel at a depth (voxels, inside positive) below the surface of opaque material.
inline float opaque_extinction_per_voxel(float depth_in_voxels) {
  return kOpaqueDepthPerVoxel * std::clamp(depth_in_voxels - kOpaqueOnset, 0.0f, 1.0f);
}

}  // namespace sarnerf
