// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/trace/box_tracer.h"

#include <array>

namespace sarnerf {
namespace {

/// Two triangles for each face; corner n has the box's maximum along x, y, z where bits 0, 1, 2 are set.
constexpr std::array<std::array<unsigned, 3>, 12> kFaces{{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                                          {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                                          {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}}};

}  // namespace

BoxTracer::BoxTracer(std::span<const FloatBox> boxes) {
  vertices_m_.reserve(8 * boxes.size() + 1);
  triangles_.reserve(12 * boxes.size());
  for (const FloatBox& box : boxes) {
    const auto first = static_cast<unsigned>(vertices_m_.size());
    for (unsigned n = 0; n < 8; ++n) {
      vertices_m_.emplace_back(n & 1 ? box.max.x : box.min.x, n & 2 ? box.max.y : box.min.y,
                               n & 4 ? box.max.z : box.min.z);
    }
    for (const auto& face : kFaces) triangles_.emplace_back(first + face[0], first + face[1], first + face[2]);
  }
  vertices_m_.emplace_back(0.0f);  // RayTracer wants a readable element behind the end
  tracer_ = std::make_unique<RayTracer>(std::span(vertices_m_).first(vertices_m_.size() - 1), triangles_);
}

std::uint64_t BoxTracer::memory_bytes() const {
  return tracer_->memory_bytes() + vertices_m_.size() * sizeof(glm::vec3) +
         triangles_.size() * sizeof(glm::uvec3);
}

}  // namespace sarnerf
