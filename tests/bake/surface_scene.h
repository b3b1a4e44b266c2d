// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <utility>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"
#include "solid_meshes.h"

/// Scenes for the field `surface`, and how radars see them.
namespace sarnerf::test {

inline constexpr double kScenePixel_m = 0.3;

/// One closed body whose brightness is the cosine of the incidence, about the origin.
inline Scene scene_of(SurfaceMesh mesh) {
  Box box;
  for (const glm::dvec3& v : mesh.vertices_m) box.include(v);
  // Off the lattice's symmetries.
  mesh = moved(std::move(mesh), glm::dvec3(0.013, 0.037, -0.021) - box.centre());
  Scene scene;
  scene.mesh.vertices_m = mesh.vertices_m;
  scene.mesh.triangles = mesh.triangles;
  for (auto* index : {&scene.mesh.material, &scene.mesh.piece, &scene.mesh.group}) index->assign(mesh.triangles.size(), 0);
  scene.pieces = {Piece{true, 0}};
  scene.objects.resize(1);
  scene.groups = {"body"};
  scene.materials = {Material{}};
  for (const glm::dvec3& v : mesh.vertices_m) scene.box.include(v);
  return scene;
}

/// Towards the origin, from an incidence of 45°.
inline Acquisition view_from(double azimuth_rad) {
  Acquisition a;
  a.incidence_rad = 0.25 * std::numbers::pi;
  a.azimuth_rad = azimuth_rad;
  a.slant_range_m = 10'000.0;
  a.n_azimuth = a.n_range = 80;
  a.azimuth_spacing_m = a.range_spacing_m = kScenePixel_m;
  return a;
}

}  // namespace sarnerf::test
