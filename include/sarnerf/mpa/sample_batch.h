// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace sarnerf {

/// Bin of a segment nearer than bin 0: it attenuates what lies behind and contributes to no pixel.
inline constexpr std::uint32_t kNoBin = 0xffffffffu;

/// Segments of many rays in compressed-row form: ray q owns segments [ray_begin[q], ray_begin[q + 1]),
/// ordered by range, each inside one bin. The pixel of segment s is bin[s] of image row ray_row[q].
struct SampleBatch {
  std::vector<std::uint32_t> ray_begin{0};   ///< [n_rays + 1]
  std::vector<std::uint32_t> ray_row;        ///< [n_rays] row of the batch's image, 0-based
  std::vector<std::uint32_t> ray_elevation;  ///< [n_rays] k
  std::vector<glm::vec3> ray_direction;  ///< [n_rays] world frame, from the radar into the scene

  std::vector<std::uint32_t> bin;  ///< [n_segments] j or kNoBin
  std::vector<float> length_m;     ///< [n_segments] ℓ ≤ Δr
  std::vector<glm::vec3> point_m;  ///< [n_segments] centre, relative to the aim point, world axes

  std::size_t n_rays() const { return ray_row.size(); }
  std::size_t n_segments() const { return bin.size(); }
  void clear();
};

/// What the integrators need to know about the segments; a view, so that the caller owns all memory.
template <class T>
struct SegmentSpans {
  std::span<const std::uint32_t> ray_begin;  ///< [n_rays + 1]
  std::span<const std::uint32_t> ray_row;    ///< [n_rays]
  std::span<const std::uint32_t> bin;        ///< [n_segments]
  std::span<const T> length_m;               ///< [n_segments]
};

SegmentSpans<float> spans(const SampleBatch& batch);

}  // namespace sarnerf
