// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/surface_distance.h"

namespace sarnerf {

/// The side of a sheet that no radar above the horizon sees. The sheet's opaque voxels are placed on that side,
/// so that the visible side is imaged at its true range.
enum class HiddenSide : std::uint8_t { none, front, back };

/// A part of the mesh that is voxelised as one: a closed piece, or all sheets and pieces too small for the voxels
/// to resolve.
struct VoxelSurface {
  std::vector<std::uint32_t> triangles;  ///< scene triangle of each of the surface's triangles
  std::unique_ptr<SurfaceDistance> distance;
  bool closed = false;  ///< false: sheets, without an inside
  const Material* medium = nullptr;  ///< null: opaque
  std::vector<HiddenSide> hidden;    ///< per triangle, of sheets
};

/// Divides the scene's mesh into surfaces: one for each closed piece, and one for all opaque pieces that are open
/// or too small for `voxel_size_m`. Open translucent pieces bound no volume and are left out.
std::vector<VoxelSurface> make_voxel_surfaces(const Scene& scene, double voxel_size_m,
                                              const Monitor& monitor);

/// Values of a brick's voxels, before they become leaves of OpenVDB grids.
struct VoxelBrick {
  std::bitset<kBrickVoxels> occupied;    ///< has extinction or scattering
  std::bitset<kBrickVoxels> opaque;      ///< occupied by opaque material
  std::bitset<kBrickVoxels> attributes;  ///< brightness, normal, exponent and component are set
  std::array<float, kBrickVoxels> extinction_per_m, extinction_back_per_m;
  std::array<float, kBrickVoxels> scattering_per_m;  ///< of translucent material
  std::array<float, kBrickVoxels> gamma0, exponent;
  std::array<glm::vec3, kBrickVoxels> normal;
  std::array<Component, kBrickVoxels> component;

  VoxelBrick();
};

/// Computes the voxels of bricks from the surfaces.
class BrickVoxeliser {
 public:
  /// All arguments must outlive this object; `component` has a value for each triangle of the scene.
  BrickVoxeliser(const Scene& scene, std::span<const VoxelSurface> surfaces,
                 std::span<const Component> component, const GridTransform& transform)
      : scene_(scene), surfaces_(surfaces), component_(component), transform_(transform) {}

  /// Distance (voxels) up to which surfaces set voxels: two voxels beyond the occupied ones outside, and deep
  /// enough inside for an optical depth of 20.
  static constexpr double kReach = 3.0;

  /// Fills the brick from the given surfaces. Returns whether any voxel was set.
  bool fill(const glm::ivec3& brick, std::span<const std::uint32_t> surfaces,
            VoxelBrick& voxels) const;

  /// Whether a voxel lies inside a surface, at any distance from it.
  bool holds(std::uint32_t surface, const glm::ivec3& voxel) const;

 private:
  void fill_opaque(const glm::ivec3& first, const VoxelSurface& surface, VoxelBrick& voxels,
                   std::span<float> depth) const;
  void fill_medium(const glm::ivec3& first, const VoxelSurface& surface, VoxelBrick& voxels) const;
  void add_medium(const Material& medium, double coverage, std::size_t voxel,
                  VoxelBrick& voxels) const;
  double thickness(const VoxelSurface& surface, const glm::dvec3& point_m,
                   const NearestPoint& nearest, bool inside) const;
  void set_attributes(const VoxelSurface& surface, const NearestPoint& nearest, std::size_t voxel,
                      VoxelBrick& voxels) const;

  const Scene& scene_;
  std::span<const VoxelSurface> surfaces_;
  std::span<const Component> component_;
  GridTransform transform_;
};

/// Depth (voxels) assigned to the middle of a thin sheet of any thickness, so that less than 1e-5 of the power
/// passes through it at any position of the lattice. A sheet is imaged up to this distance too early.
inline constexpr float kSheetDepth = 1.0f;

/// Depth (voxels) used for a point at a depth below a surface whose material has a given thickness there: thin
/// material is thickened until it is opaque.
inline float thickened_depth(float depth_in_voxels, float thickness_in_voxels) {
  return depth_in_voxels + std::max(0.0f, kSheetDepth - 0.5f * thickness_in_voxels);
}

}  // namespace sarnerf
