// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace sarnerf {

/// Triangle index of a ray without a hit.
inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;

/// Rays as a structure of arrays, so that packets load without shuffling. All spans have
/// the same length; directions have unit length; nothing may be NaN.
struct RayRow {
  std::span<const float> origin_x, origin_y, origin_z;           ///< scene frame (m)
  std::span<const float> direction_x, direction_y, direction_z;  ///< scene frame
  float far_m = 0.0f;                                            ///< hits beyond this distance are ignored
};

/// First hits of a RayRow. For a ray without a hit only `triangle` is meaningful.
struct HitRow {
  std::span<float> distance_m;
  std::span<float> normal_x, normal_y, normal_z;  ///< right-handed by the triangle's winding, any length
  std::span<std::uint32_t> triangle;              ///< index, or kNoTriangle
};

/// One intersection of a ray with a triangle.
struct Crossing {
  float distance_m;
  std::uint32_t triangle;
  glm::vec3 normal;  ///< right-handed by the triangle's winding, any length
};

/// Ray queries against a fixed set of triangles, by Embree (3 or 4). Watertight: a ray that meets an
/// edge shared by two triangles hits one of them. Immutable after construction; queries may run on any
/// number of threads.
class RayTracer {
 public:
  /// Copies nothing: vertices (m, scene frame) and triangles must outlive the tracer, and `vertices_m`
  /// needs one readable element behind its end, because Embree loads 16 bytes at a time. Throws Error with
  /// Embree's error code when it cannot build.
  RayTracer(std::span<const glm::vec3> vertices_m, std::span<const glm::uvec3> triangles);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  static constexpr std::size_t kRowsPerBlock = 8;

  /// Nearest hit of every ray of up to kRowsPerBlock rows of equal length, in coherent packets of 16
  /// that span all rows: ray n of one row should be near ray n of the next. Compact packets over 4 or 8
  /// rows take a half to three quarters of the time of packets along one row, and fine meshes are
  /// fetched into the cache once for all rows.
  void first_hits(std::span<const RayRow> rows, std::span<const HitRow> hits) const;

  /// The same ray by ray, without packets: the reference for benchmarks and tests.
  void first_hits_one_by_one(const RayRow& rays, const HitRow& hits) const;

  /// All triangles that the ray meets up to far_m, sorted by distance; overwrites `crossings`.
  void all_hits(const glm::vec3& origin_m, const glm::vec3& direction, float far_m,
                std::vector<Crossing>& crossings) const;

  /// Whether the ray meets any triangle up to far_m, which may be infinite: cheaper than the nearest hit.
  bool meets_any(const glm::vec3& origin_m, const glm::vec3& direction, float far_m) const;

  /// Bytes that Embree holds, now and at the peak of the build.
  std::uint64_t memory_bytes() const;
  std::uint64_t peak_memory_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Finds where rays from outside first enter any of a set of axis-aligned boxes, such as the occupied parts of a
/// volume's leaves. A box is twelve triangles in Embree's BVH, because its packets are faster than user
/// geometry, which needs callbacks.
class BoxTracer {
 public:
  struct FloatBox {
    glm::vec3 min, max;  ///< scene frame (m)
  };

  explicit BoxTracer(std::span<const FloatBox> boxes);

  /// As RayTracer::first_hits(). A ray that starts inside a box gets its exit from the box.
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
