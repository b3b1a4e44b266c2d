// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/geometry/acquisition.h"

/// What the surface of a solid must fulfil.
namespace sarnerf::test {

/// Positive where triangles are counter-clockwise seen from outside. Relative to a vertex, for map coordinates.
inline double signed_volume_m3(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 o = mesh.vertices_m[0];
    volume += glm::dot(mesh.vertices_m[t.x] - o, glm::cross(mesh.vertices_m[t.y] - o, mesh.vertices_m[t.z] - o)) / 6.0;
  }
  return volume;
}

inline double area_m2(const SurfaceMesh& mesh, const glm::uvec3& t) {
  const glm::dvec3 a = mesh.vertices_m[t.x];
  return 0.5 * glm::length(glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a));
}

inline double area_m2(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (const glm::uvec3& t : mesh.triangles) area += area_m2(mesh, t);
  return area;
}

inline Box box_m(const SurfaceMesh& mesh) {
  Box box;
  for (const glm::dvec3& v : mesh.vertices_m) box.include(v);
  return box;
}

struct EdgeCounts {
  std::size_t edges = 0;
  std::size_t open = 0;      ///< not as often along one direction as along the other
  std::size_t repeated = 0;  ///< of more than two triangles
};

inline EdgeCounts edge_counts(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, int>> along;  // how often up and down
  for (const glm::uvec3& t : mesh.triangles) {
    for (int n = 0; n < 3; ++n) {
      const std::uint32_t a = t[n], b = t[(n + 1) % 3];
      auto& [up, down] = along[std::minmax(a, b)];
      ++(a < b ? up : down);
    }
  }
  EdgeCounts counts;
  counts.edges = along.size();
  for (const auto& [edge, count] : along) {
    counts.open += count.first != count.second ? 1 : 0;
    counts.repeated += count.first + count.second > 2 ? 1 : 0;
  }
  return counts;
}

/// 2 for a sphere, 0 for a torus.
inline long euler_characteristic(const SurfaceMesh& mesh) {
  return static_cast<long>(mesh.vertices_m.size()) - static_cast<long>(edge_counts(mesh).edges) +
         static_cast<long>(mesh.triangles.size());
}

/// One vertex at each place, all of them in use, and no triangle without area.
inline bool is_tidy(const SurfaceMesh& mesh) {
  std::set<std::tuple<double, double, double>> places;
  for (const glm::dvec3& v : mesh.vertices_m) places.emplace(v.x, v.y, v.z);
  std::set<std::uint32_t> used;
  bool areas = true;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int n = 0; n < 3; ++n) used.insert(t[n]);
    areas = areas && area_m2(mesh, t) > 0.0;
  }
  return areas && places.size() == mesh.vertices_m.size() && used.size() == mesh.vertices_m.size();
}

}  // namespace sarnerf::test
