// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

/// Where rays from outside first enter any of a set of axis-aligned boxes, such as the occupied parts of a
/// volume's leaves. Twelve triangles a box, in Embree's tree of triangles: its packets are faster than
/// calling back for boxes.
class BoxTracer {
 public:
  struct FloatBox {
    glm::vec3 min, max;  ///< scene frame (m)
  };

  explicit BoxTracer(std::span<const FloatBox> boxes);

  /// As RayTracer::first_hits(); a ray that starts inside of a box gets where it leaves it.
  void entries(std::span<const RayRow> rows, std::span<const HitRow> hits) const {
    tracer_->first_hits(rows, hits);
  }

  std::uint64_t memory_bytes() const;

 private:
  std::vector<glm::vec3> vertices_m_;
  std::vector<glm::uvec3> triangles_;
  std::unique_ptr<RayTracer> tracer_;
};

}  // namespace sarnerf
