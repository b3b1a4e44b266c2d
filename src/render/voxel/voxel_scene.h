// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "appearance.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/vdb_scene.h"
#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

/// Component and incidence at points of a volume, for layers. One per thread; the volume must outlive it.
class VolumeSurface {
 public:
  /// `grid`: the volume's, with its transform in the frame of the points.
  VolumeSurface(const Volume& volume, const BrickView<const float>& grid);

  /// Component with the largest sum of trilinear weights over the voxels around the point that have one, the occupied ones and those
  /// beside them;
  /// `other` in volumes without components.
  Component component(const glm::vec3& point_m);

  /// Angle (rad) between a ray and the normal; NaN where the volume has none.
  double incidence_rad(const glm::vec3& point_m, const glm::vec3& direction);

 private:
  const Volume& volume_;
  GridTransform transform_;
  BrickFinder finder_;
  TrilinearSampler sampler_;
  std::vector<float> channels_;
};

/// A volume prepared for ray casting: its occupancy, and Embree's BVH over the occupied boxes.
struct VoxelScene {
  /// `scene` provides the ground and must outlive this.
  VoxelScene(const Scene& scene, Volume volume);

  VoxelScene(const VoxelScene&) = delete;
  VoxelScene& operator=(const VoxelScene&) = delete;

  /// The scene as input of a plan: the volume's box and the ground.
  Scene planned() const;

  /// Boxes of occupied voxels relative to an aim point.
  std::vector<Box> boxes_from(const glm::dvec3& aim_m) const;

  std::uint64_t memory_bytes() const;

  const Scene& scene;
  Volume volume;
  Occupancy occupancy;
  std::vector<Box> boxes_m;  ///< world coordinates
  glm::dvec3 origin_m;       ///< of the scene frame, in which Embree works
  double slack_m;            ///< margin of the traced boxes, so that rounding makes no ray miss one
  std::optional<BoxTracer> tracer;
  std::optional<Appearance> ground;
};

}  // namespace sarnerf
