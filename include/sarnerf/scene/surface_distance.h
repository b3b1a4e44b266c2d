// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>

namespace sarnerf {

/// Nearest point of a surface to a query point.
struct NearestPoint {
  glm::dvec3 point_m{0.0};
  std::uint32_t triangle = 0;  ///< triangle that contains it
  double distance_m = 0.0;
};

/// Next triangle that a ray hits, and the distance to it.
struct FreePath {
  double length_m = 0.0;
  std::uint32_t triangle = 0;
};

/// Distances to a triangulated surface, by CGAL's tree of boxes; logarithmic in the number of triangles,
/// one to five microseconds each. Queries may run on any number of threads. Part of the library scene_cgal,
/// apart from scene, because CGAL changes the compiler's rounding flags of the code that uses it.
class SurfaceDistance {
 public:
  /// `closed`: the surface bounds a volume, and its triangles face outward. Triangles without area are
  /// ignored; throws InputError if there is no other.
  SurfaceDistance(std::span<const glm::dvec3> vertices_m, std::span<const glm::uvec3> triangles,
                  bool closed);
  ~SurfaceDistance();
  SurfaceDistance(const SurfaceDistance&) = delete;
  SurfaceDistance& operator=(const SurfaceDistance&) = delete;

  NearestPoint nearest(const glm::dvec3& point_m) const;
  /// The same, with a probably near point as start: faster for a sequence of neighbouring points.
  NearestPoint nearest(const glm::dvec3& point_m, const NearestPoint& hint) const;

  /// Whether the volume contains the point. Uses an exact test where the nearest point lies on an edge, and
  /// the side of the nearest triangle elsewhere. Always false for a surface that is not closed.
  bool holds(const glm::dvec3& point_m, const NearestPoint& nearest) const;

  /// From a point next to the surface along a unit direction: the next triangle other than `from`, if any.
  std::optional<FreePath> free_path(const glm::dvec3& from_m, const glm::dvec3& direction,
                                    std::uint32_t from) const;

  /// Whether a ray hits any triangle.
  bool meets_any(const glm::dvec3& from_m, const glm::dvec3& direction) const;

  /// Outward unit normal of a triangle.
  glm::dvec3 normal(std::uint32_t triangle) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sarnerf
