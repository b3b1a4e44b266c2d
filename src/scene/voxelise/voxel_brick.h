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

/// What a brick's voxels hold, before it becomes leaves of OpenVDB grids.
struct VoxelBrick {
  std::bitset<kBrickVoxels> occupied;    ///< extinction or scattering
  std::bitset<kBrickVoxels> opaque;      ///< by opaque matter
  std::bitset<kBrickVoxels> attributes;  ///< brightness, normal, exponent and component are set
  std::array<float, kBrickVoxels> extinction_per_m, extinction_back_per_m;
  std::array<float, kBrickVoxels> scattering_per_m;  ///< of translucent matter
  std::array<float, kBrickVoxels> gamma0, exponent;
  std::array<glm::vec3, kBrickVoxels> normal;
  std::array<Component, kBrickVoxels> component;

  VoxelBrick();
};

/// Asks the surfaces for what they do to bricks.
class BrickVoxeliser {
 public:
  /// All arguments must outlive it; `component` is per triangle of the scene.
  BrickVoxeliser(const Scene& scene, std::span<const VoxelSurface> surfaces,
                 std::span<const Component> component, const GridTransform& transform)
      : scene_(scene), surfaces_(surfaces), component_(component), transform_(transform) {}

  /// How far (voxels) surfaces reach: two voxels beyond what answers, and as deep as an optical depth of
  /// 20 needs.
  static constexpr double kReach = 3.0;

  /// Fills the brick with all that the given surfaces put there. Returns whether that is anything.
  bool fill(const glm::ivec3& brick, std::span<const std::uint32_t> surfaces,
            VoxelBrick& voxels) const;

  /// Whether a voxel lies inside a surface, however far from it.
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

/// Depth (voxels) that the middle of a thin sheet is given whatever its thickness, so that less than 1e-5
/// of the power passes through it at any position of the lattice. A sheet answers up to this much early.
inline constexpr float kSheetDepth = 1.0f;

/// Depth at which a point counts that lies `depth` (voxels) below a surface whose matter is `thickness`
/// (voxels) thick there: thin matter is thickened until it is opaque.
inline float thickened_depth(float depth_in_voxels, float thickness_in_voxels) {
  return depth_in_voxels + std::max(0.0f, kSheetDepth - 0.5f * thickness_in_voxels);
}

}  // namespace sarnerf
