// SPDX-License-Identifier: Apache-2.0
#include "surface_samples.h"

#include <cmath>

namespace sarnerf {
namespace {

/// Additive recurrence in three dimensions: steps 1/g, 1/g², 1/g³ with g⁴ = g + 1, the generalised golden ratio.
constexpr double kRatio = 1.2207440846057596;

double step(std::size_t n, double ratio) {
  const double x = 0.5 + static_cast<double>(n) / ratio;
  return x - std::floor(x);
}

glm::dvec3 area_vector(const SurfaceMesh& mesh, const glm::uvec3& t) {
  const glm::dvec3& a = mesh.vertices_m[t.x];
  return 0.5 * glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a);
}

}  // namespace

std::vector<SurfaceSample> sample_surface(const SurfaceMesh& mesh, std::size_t n) {
  double total_m2 = 0.0;
  for (const glm::uvec3& t : mesh.triangles) total_m2 += glm::length(area_vector(mesh, t));
  std::vector<SurfaceSample> samples;
  if (!(total_m2 > 0.0)) return samples;
  samples.reserve(n);

  double end_m2 = 0.0;  // area up to and with triangle t
  for (std::uint32_t t = 0; t < mesh.triangles.size() && samples.size() < n; ++t) {
    const glm::uvec3& corners = mesh.triangles[t];
    const glm::dvec3 area = area_vector(mesh, corners);
    const double area_m2 = glm::length(area);
    if (!(area_m2 > 0.0)) continue;
    end_m2 += area_m2;
    while (samples.size() < n) {
      // Anywhere in its stratum: at equal steps a mesh of equal triangles would give always the same ones.
      const std::size_t m = samples.size();
      const double at_m2 = (static_cast<double>(m) + step(m, kRatio)) * (total_m2 / static_cast<double>(n));
      if (at_m2 >= end_m2) break;
      double u = step(m, kRatio * kRatio), v = step(m, kRatio * kRatio * kRatio);
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      const glm::dvec3& a = mesh.vertices_m[corners.x];
      samples.push_back({a + u * (mesh.vertices_m[corners.y] - a) + v * (mesh.vertices_m[corners.z] - a),
                         area / area_m2, t});
    }
  }
  return samples;
}

}  // namespace sarnerf
