// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "sarnerf/field/trilinear.h"
#include "sarnerf/scene/volume.h"

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

}  // namespace sarnerf
