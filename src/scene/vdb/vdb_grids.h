// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <openvdb/openvdb.h>

#include "sarnerf/field/field_sampler.h"
#include "sarnerf/scene/vdb_scene.h"

// OpenVDB's classes of grids have hundreds of virtual functions each, which every unit would compile again: a third of the
// time that scene takes to build. They are instantiated in vdb_grids.cpp.
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::Vec3STree>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;

namespace sarnerf {

/// The grids behind a VdbScene: null where the scene has none. All share one transform, uniform scale and
/// translation, in world metres with Y up.
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
  openvdb::FloatGrid::Ptr occupancy;        ///< optional: 0 outside of a body and 1 inside, for those who want its shape
  openvdb::MetaMap metadata;  ///< of the file, beside what write_vdb() sets itself

  /// Those that exist, in the order of the channels; `component` and `occupancy` last.
  std::vector<openvdb::GridBase::Ptr> all() const;
};

/// Throws UsageError unless the grids that the basis asks for are there, and no others.
void require_complete(const VdbScene::Grids& grids);

/// Transform of grids with voxel centres at `transform`'s integer indices.
openvdb::math::Transform::Ptr vdb_transform(const GridTransform& transform);
/// Inverse of vdb_transform(). Throws InputError unless the map is uniform scale and translation.
GridTransform grid_transform(const openvdb::math::Transform& transform, const std::string& where);

/// Two-way optical depth of a voxel well inside opaque matter.
inline constexpr float kOpaqueDepthPerVoxel = 20.0f;

/// Depth (voxels) below a surface at which its matter begins to absorb. Interpolated between voxels, what
/// begins here answers a radar as if from depth 0 on average over all positions of the lattice, all
/// orientations and incidences up to 75°; the scatter about that is 0.15 voxels. Matter that began at the
/// surface itself would answer 0.14 voxels deep, coverage of a voxel by matter 0.64 voxels too early.
inline constexpr float kOpaqueOnset = 0.14f;

/// Two-way optical depth per voxel at a depth (voxels, inside positive) below the surface of opaque matter.
inline float opaque_extinction_per_voxel(float depth_in_voxels) {
  return kOpaqueDepthPerVoxel * std::clamp(depth_in_voxels - kOpaqueOnset, 0.0f, 1.0f);
}

}  // namespace sarnerf
