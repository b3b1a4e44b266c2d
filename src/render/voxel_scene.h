// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "appearance.h"
#include "sarnerf/field/occupancy.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/volume.h"
#include "sarnerf/trace/box_tracer.h"

namespace sarnerf {

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
