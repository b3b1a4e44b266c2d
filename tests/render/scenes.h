// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "geometry/acquisitions.h"
#include "sarnerf/render/framing.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"

/// Scenes built in memory, so that these tests need no files.
namespace sarnerf::test {

inline Material matte(double exponent = 0.0, double gamma0 = 1.0) {
  Material m;
  m.name = "matte";
  m.gamma0 = gamma0;
  m.exponent = exponent;
  return m;
}

inline Material fog(double extinction_per_m, double scattering_per_m) {
  Material m;
  m.name = "fog";
  m.opaque = false;
  m.extinction_per_m = m.extinction_back_per_m = extinction_per_m;
  m.scattering_per_m = scattering_per_m;
  return m;
}

/// Squares of three quarters and of five quarters of the mean.
inline Material checkered(double period_m) {
  Material m = matte(2.0);
  m.texture = {Texture::Kind::checker, period_m, 0.25, {}};
  return m;
}

inline Scene empty_scene(Material material) {
  Scene scene;
  scene.materials = {std::move(material)};
  scene.objects = {{"object", glm::dmat4(1.0)}};
  scene.groups = {""};
  return scene;
}

/// Adds one connected piece; returns its index.
inline std::uint32_t add_piece(Scene& scene, const std::vector<glm::dvec3>& vertices,
                               const std::vector<glm::uvec3>& triangles, bool closed,
                               std::uint32_t material = 0) {
  const auto base = static_cast<std::uint32_t>(scene.mesh.vertices_m.size());
  const auto piece = static_cast<std::uint32_t>(scene.pieces.size());
  scene.pieces.push_back({closed, 0});
  for (const auto& v : vertices) {
    scene.mesh.vertices_m.push_back(v);
    scene.box.include(v);
  }
  for (const auto& t : triangles) {
    scene.mesh.triangles.push_back(t + base);
    scene.mesh.material.push_back(material);
    scene.mesh.piece.push_back(piece);
    scene.mesh.group.push_back(0);
  }
  return piece;
}

/// Solid between a rectangle (half sides bottom) at y = 0 and one (half sides top) at y = height,
/// turned by `turn_rad` about Y like the radar's azimuth, then shifted.
inline void add_frustum(Scene& scene, glm::dvec2 bottom, glm::dvec2 top, double height_m,
                        double turn_rad = 0.0, glm::dvec3 shift = glm::dvec3(0.0),
                        std::uint32_t material = 0) {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  std::vector<glm::dvec3> v;
  const auto add = [&](double x, double y, double z) {
    v.push_back(shift + glm::dvec3(c * x + s * z, y, -s * x + c * z));
  };
  for (const auto& [half, y] : {std::pair{bottom, 0.0}, std::pair{top, height_m}}) {
    add(-half.x, y, -half.y);
    add(half.x, y, -half.y);
    add(half.x, y, half.y);
    add(-half.x, y, half.y);
  }
  add_piece(scene, v,
            {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {3, 2, 6}, {3, 6, 7},
             {1, 0, 4}, {1, 4, 5}, {2, 1, 5}, {2, 5, 6}, {0, 3, 7}, {0, 7, 4}},
            true, material);
}

/// Box with the given size standing on y = 0, its centre over the origin.
inline void add_box(Scene& scene, glm::dvec3 size, double turn_rad = 0.0,
                    glm::dvec3 shift = glm::dvec3(0.0), std::uint32_t material = 0) {
  const glm::dvec2 half(0.5 * size.x, 0.5 * size.z);
  add_frustum(scene, half, half, size.y, turn_rad, shift, material);
}

/// One rectangle p, p + u, p + u + v, p + v; its front is where u × v points.
inline void add_sheet(Scene& scene, glm::dvec3 p, glm::dvec3 u, glm::dvec3 v, bool closed = false) {
  add_piece(scene, {p, p + u, p + u + v, p + v}, {{0, 1, 2}, {0, 2, 3}}, closed);
}

/// NaN of two blank images, unlike relative_l2_error(): a test that lost its scene fails.
inline double relative_l2(const Image<float>& image, const Image<float>& reference) {
  double difference = 0.0, norm = 0.0;
  for (std::size_t n = 0; n < reference.pixels().size(); ++n) {
    const double r = reference.pixels()[n];
    difference += (image.pixels()[n] - r) * (image.pixels()[n] - r);
    norm += r * r;
  }
  return std::sqrt(difference / norm);
}

inline double sum(const Image<float>& image) {
  double total = 0.0;
  for (const float p : image.pixels()) total += p;
  return total;
}

/// The image of a view by the surface engine.
inline Image<float> render(const Scene& scene, const Acquisition& view, Sampling sampling = {}) {
  const SurfaceEngine engine(scene);
  return engine.render(engine.plan(view, sampling)).beta0;
}

}  // namespace sarnerf::test
