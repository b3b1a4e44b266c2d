// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "appearance.h"
#include "media.h"
#include "sarnerf/scene/component.h"
#include "sarnerf/trace/ray_tracer.h"
#include "triangle_subset.h"

namespace sarnerf {

/// A scene made ready for ray casting: what the surface engine builds once for all views.
class SurfaceScene {
 public:
  /// `scene` must outlive it.
  explicit SurfaceScene(const Scene& scene);

  /// Of the triangles in `opaque`; found when layers are asked for the first time.
  std::span<const Component> components() const;
  std::uint64_t memory_bytes() const;

  const Scene& scene;
  glm::dvec3 origin_m;  ///< of the scene frame, in which Embree works
  AppearanceTable appearances;
  TriangleSubset opaque;
  std::unique_ptr<RayTracer> tracer;
  Media media;
  std::vector<std::string> warnings;

 private:
  mutable std::once_flag components_found_;
  mutable std::vector<Component> components_;
};

}  // namespace sarnerf
