// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bitset>
#include <span>
#include <vector>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/scene/component.h"
#include "voxel_surface.h"

namespace sarnerf {

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

}  // namespace sarnerf
