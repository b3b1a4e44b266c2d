// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <string>

#include "sarnerf/scene/scene.h"

/// Meshes as OBJ text, and what a closed mesh must fulfil.
namespace sarnerf::test {

/// Twelve triangles, outward, or inward when `inverted`.
inline constexpr std::array<std::array<int, 3>, 12> kCubeFaces = {{{0, 1, 2},
                                                                   {0, 2, 3},
                                                                   {4, 6, 5},
                                                                   {4, 7, 6},
                                                                   {3, 2, 6},
                                                                   {3, 6, 7},
                                                                   {1, 0, 4},
                                                                   {1, 4, 5},
                                                                   {2, 1, 5},
                                                                   {2, 5, 6},
                                                                   {0, 3, 7},
                                                                   {0, 7, 4}}};

inline glm::dvec3 cube_corner(int n, glm::dvec3 min, double side) {
  const bool x = n % 4 == 1 || n % 4 == 2, y = n >= 4, z = n % 4 >= 2;
  return min + side * glm::dvec3(x, y, z);
}

/// Builds OBJ text vertex by vertex.
class ObjBuilder {
 public:
  int vertex(glm::dvec3 p) {
    std::array<char, 96> line;
    std::snprintf(line.data(), line.size(), "v %.17g %.17g %.17g\n", p.x, p.y, p.z);
    text_ += line.data();
    return ++count_;
  }
  void triangle(int a, int b, int c) {
    text_ += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  }
  void line(const std::string& text) { text_ += text + "\n"; }

  void cube(glm::dvec3 min, double side, bool inverted = false) {
    const int first = count_ + 1;
    for (int n = 0; n < 8; ++n) vertex(cube_corner(n, min, side));
    for (const auto& f : kCubeFaces) {
      triangle(first + f[0], first + f[inverted ? 2 : 1], first + f[inverted ? 1 : 2]);
    }
  }
  /// The same cube with three vertices of its own for each triangle.
  void split_cube(glm::dvec3 min, double side) {
    for (const auto& f : kCubeFaces) {
      const int a = vertex(cube_corner(f[0], min, side));
      const int b = vertex(cube_corner(f[1], min, side));
      triangle(a, b, vertex(cube_corner(f[2], min, side)));
    }
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  int count_ = 0;
};

/// Volume by the divergence theorem, of one piece: positive when its triangles look outward.
inline double signed_volume(const Scene& scene, std::uint32_t piece) {
  double volume = 0.0;
  const glm::dvec3 origin = scene.box.centre();
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.mesh.piece[t] != piece) continue;
    const glm::uvec3 v = scene.mesh.triangles[t];
    const glm::dvec3 a = scene.mesh.vertices_m[v.x] - origin,
                     b = scene.mesh.vertices_m[v.y] - origin,
                     c = scene.mesh.vertices_m[v.z] - origin;
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return volume;
}

inline double area(const Scene& scene) {
  double sum = 0.0;
  for (const glm::uvec3& v : scene.mesh.triangles) {
    const glm::dvec3 a = scene.mesh.vertices_m[v.x];
    sum += 0.5 *
           glm::length(glm::cross(scene.mesh.vertices_m[v.y] - a, scene.mesh.vertices_m[v.z] - a));
  }
  return sum;
}

}  // namespace sarnerf::test
