// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>

namespace sarnerf {

/// Nearest point of a surface.
struct NearestPoint {
  glm::dvec3 point_m{0.0};
  std::uint32_t triangle = 0;  ///< on which it lies
  double distance_m = 0.0;
};

/// What a ray meets next.
struct FreePath {
  double length_m = 0.0;
  std::uint32_t triangle = 0;
};

/// Distances to a triangulated surface, by CGAL's tree of boxes; logarithmic in the number of triangles,
/// one to five microseconds each. Queries may run on any number of threads. Lives in the library scene_cgal,
/// apart from scene, because CGAL changes the rounding flags of whatever is compiled with it.
class SurfaceDistance {
 public:
  /// `closed`: the surface bounds a volume, and its triangles look outward. Triangles without area are
  /// not looked at; throws InputError when there is no other.
  SurfaceDistance(std::span<const glm::dvec3> vertices_m, std::span<const glm::uvec3> triangles,
                  bool closed);
  ~SurfaceDistance();
  SurfaceDistance(const SurfaceDistance&) = delete;
  SurfaceDistance& operator=(const SurfaceDistance&) = delete;

  NearestPoint nearest(const glm::dvec3& point_m) const;
  /// The same, begun with a point that is probably near: faster in a walk over neighbouring points.
  NearestPoint nearest(const glm::dvec3& point_m, const NearestPoint& hint) const;

  /// Whether the volume holds the point: exact where the nearest point lies on an edge, by the nearest
  /// triangle's side elsewhere. Always false for a surface that is not closed.
  bool holds(const glm::dvec3& point_m, const NearestPoint& nearest) const;

  /// From a point next to the surface along a unit direction, the next triangle other than `from`.
  std::optional<FreePath> free_path(const glm::dvec3& from_m, const glm::dvec3& direction,
                                    std::uint32_t from) const;

  /// Whether a ray meets any triangle.
  bool meets_any(const glm::dvec3& from_m, const glm::dvec3& direction) const;

  /// Outward unit normal of a triangle.
  glm::dvec3 normal(std::uint32_t triangle) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sarnerf
