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

/// What layers ask about a point of a volume. One per thread; the volume must outlive it.
class VolumeSurface {
 public:
  /// `grid`: the volume's, with its transform in the frame of the points.
  VolumeSurface(const Volume& volume, const BrickView<const float>& grid);

  /// Component that most of the occupied voxels around the point have, by their weights in the
  /// interpolation; `other` in volumes that do not say.
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

/// A volume made ready for rays: what of it is occupied, and Embree's tree over that.
struct VoxelScene {
  /// `scene` gives the ground, and must outlive this.
  VoxelScene(const Scene& scene, Volume volume);

  VoxelScene(const VoxelScene&) = delete;
  VoxelScene& operator=(const VoxelScene&) = delete;

  /// What a plan should know of: the volume's box and the ground.
  Scene planned() const;

  /// Boxes of occupied matter relative to an aim point.
  std::vector<Box> boxes_from(const glm::dvec3& aim_m) const;

  std::uint64_t memory_bytes() const;

  const Scene& scene;
  Volume volume;
  Occupancy occupancy;
  std::vector<Box> boxes_m;  ///< world coordinates
  glm::dvec3 origin_m;       ///< of the scene frame, in which Embree works
  double slack_m;            ///< traced boxes are so much larger, so that none is missed by rounding
  std::optional<BoxTracer> tracer;
  std::optional<Appearance> ground;
};

}  // namespace sarnerf
