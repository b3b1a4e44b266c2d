// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>
#include <utility>

#include "sarnerf/bake/surface_mesh.h"
#include "sarnerf/bake/score.h"

/// Closed meshes that look outward.
namespace sarnerf::test {

inline SurfaceMesh box_mesh(const glm::dvec3& min, const glm::dvec3& max) {
  SurfaceMesh mesh;
  for (int n = 0; n < 8; ++n) {
    mesh.vertices_m.emplace_back(n & 1 ? max.x : min.x, n & 2 ? max.y : min.y, n & 4 ? max.z : min.z);
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

inline SurfaceMesh cube_mesh(const glm::dvec3& min, double side) { return box_mesh(min, min + side); }

inline void append(SurfaceMesh& to, const SurfaceMesh& part) {
  const auto first = static_cast<std::uint32_t>(to.vertices_m.size());
  to.vertices_m.insert(to.vertices_m.end(), part.vertices_m.begin(), part.vertices_m.end());
  for (const glm::uvec3& t : part.triangles) to.triangles.push_back(t + first);
}

inline SurfaceMesh joined(SurfaceMesh a, const SurfaceMesh& b) {
  append(a, b);
  return a;
}

inline SurfaceMesh inverted(SurfaceMesh mesh) {
  for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
  return mesh;
}

inline SurfaceMesh moved(SurfaceMesh mesh, const glm::dvec3& by, double scale = 1.0) {
  for (glm::dvec3& v : mesh.vertices_m) v = scale * v + by;
  return mesh;
}

/// An icosahedron whose triangles are cut into four `n_cuts` times, corners on the sphere.
inline SurfaceMesh sphere_mesh(const glm::dvec3& centre, double radius, int n_cuts) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  SurfaceMesh mesh;
  mesh.vertices_m = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
  for (int cut = 0; cut < n_cuts; ++cut) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.vertices_m.size()));
      if (is_new) mesh.vertices_m.push_back(mesh.vertices_m[a] + mesh.vertices_m[b]);
      return at->second;
    };
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& t : mesh.triangles) {
      const std::uint32_t a = middle(t.x, t.y), b = middle(t.y, t.z), c = middle(t.z, t.x);
      for (const glm::uvec3& part : {glm::uvec3(t.x, a, c), {t.y, b, a}, {t.z, c, b}, {a, b, c}}) finer.push_back(part);
    }
    mesh.triangles = std::move(finer);
    for (glm::dvec3& v : mesh.vertices_m) v = glm::normalize(v);
  }
  for (glm::dvec3& v : mesh.vertices_m) v = centre + radius * glm::normalize(v);
  return mesh;
}

/// Volume by the divergence theorem.
inline double divergence_volume(const SurfaceMesh& mesh) {
  double volume = 0.0;
  const glm::dvec3 origin = mesh.vertices_m.front();
  for (const glm::uvec3& t : mesh.triangles) {
    volume += glm::dot(mesh.vertices_m[t.x] - origin,
                       glm::cross(mesh.vertices_m[t.y] - origin, mesh.vertices_m[t.z] - origin)) / 6.0;
  }
  return volume;
}

/// A truth of closed pieces alone.
inline TruthSurface solid_truth(const SurfaceMesh& mesh) { return {mesh, mesh, mesh.triangles.size()}; }

}  // namespace sarnerf::test
