// SPDX-License-Identifier: Apache-2.0
#include "generated.h"

#include <cmath>

#include "sarnerf/core/units.h"

namespace sarnerf::bench {
namespace {

glm::dvec3 surface_point(double polar, double azimuth, double radius_m) {
  const double bumps = 1.0 + 0.06 * std::sin(7.0 * polar) * std::cos(9.0 * azimuth) +
                       0.02 * std::sin(31.0 * polar) * std::cos(28.0 * azimuth);
  return radius_m * (glm::dvec3(0.0, 1.1, 0.0) +
                     bumps * glm::dvec3(std::sin(polar) * std::cos(azimuth), std::cos(polar),
                                        std::sin(polar) * std::sin(azimuth)));
}

}  // namespace

Scene bumpy_sphere(std::uint64_t n_triangles, double radius_m) {
  Scene scene;
  scene.materials.emplace_back();
  scene.objects.push_back({"sphere", glm::dmat4(1.0)});
  scene.groups.emplace_back("sphere");
  scene.pieces.push_back({true, 0});

  // n rings of 2n points and the poles: about 4 n² triangles.
  const auto n_rings = static_cast<std::uint32_t>(std::sqrt(double(n_triangles) / 4.0));
  const std::uint32_t n_around = 2 * n_rings;
  Mesh& mesh = scene.mesh;
  for (std::uint32_t ring = 1; ring <= n_rings; ++ring) {
    for (std::uint32_t point = 0; point < n_around; ++point) {
      mesh.vertices_m.push_back(surface_point(kPi * ring / (n_rings + 1.0),
                                              2.0 * kPi * point / n_around, radius_m));
    }
  }
  const auto top = static_cast<std::uint32_t>(mesh.vertices_m.size());
  mesh.vertices_m.push_back(surface_point(0.0, 0.0, radius_m));
  mesh.vertices_m.push_back(surface_point(kPi, 0.0, radius_m));
  const auto at = [&](std::uint32_t ring, std::uint32_t point) {
    return ring * n_around + point % n_around;
  };
  for (std::uint32_t point = 0; point < n_around; ++point) {
    mesh.triangles.emplace_back(top, at(0, point + 1), at(0, point));
    mesh.triangles.emplace_back(top + 1, at(n_rings - 1, point), at(n_rings - 1, point + 1));
    for (std::uint32_t ring = 0; ring + 1 < n_rings; ++ring) {
      mesh.triangles.emplace_back(at(ring, point), at(ring, point + 1), at(ring + 1, point));
      mesh.triangles.emplace_back(at(ring, point + 1), at(ring + 1, point + 1), at(ring + 1, point));
    }
  }
  mesh.material.assign(mesh.triangles.size(), 0);
  mesh.piece.assign(mesh.triangles.size(), 0);
  mesh.group.assign(mesh.triangles.size(), 0);
  for (const glm::dvec3& v : mesh.vertices_m) scene.box.include(v);
  return scene;
}

}  // namespace sarnerf::bench
