// SPDX-License-Identifier: Apache-2.0
#include "corner_reflector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <unordered_map>
#include <vector>

namespace sarnerf {
namespace {

constexpr std::size_t kMaxTriangles = 200'000;
/// |cos| of the angle between faces, below which it counts as right: 3 degrees off.
constexpr double kRightAngle = 0.0523;
/// Share of the opaque area that must belong to such faces.
constexpr double kShare = 0.35;

struct Face {
  glm::dvec3 normal;  ///< unit
  double area_m2;
};

Face face_of(const Mesh& mesh, const glm::uvec3& t) {
  const glm::dvec3 p = mesh.vertices_m[t.x];
  const glm::dvec3 n = glm::cross(mesh.vertices_m[t.y] - p, mesh.vertices_m[t.z] - p);
  const double length = glm::length(n);
  return {length > 0.0 ? n / length : glm::dvec3(0.0), 0.5 * length};
}

std::uint32_t opposite_corner(const glm::uvec3& t, std::uint32_t a, std::uint32_t b) {
  for (int c = 0; c < 3; ++c) {
    if (t[c] != a && t[c] != b) return t[c];
  }
  return t.x;
}

}  // namespace

std::string corner_reflector_warning(const Scene& scene) {
  const Mesh& mesh = scene.mesh;
  if (mesh.triangles.size() > kMaxTriangles) return {};
  std::unordered_map<std::uint64_t, std::uint32_t> open_edges;
  std::vector<char> in_corner(mesh.triangles.size(), 0);
  std::vector<Face> faces;
  double total_m2 = 0.0, corner_m2 = 0.0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::uvec3 triangle = mesh.triangles[t];
    faces.push_back(face_of(mesh, triangle));
    if (!scene.materials[mesh.material[t]].opaque) continue;
    total_m2 += faces[t].area_m2;
    for (int c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax({triangle[c], triangle[(c + 1) % 3]});
      const auto [found, is_new] =
          open_edges.try_emplace(std::uint64_t(low) << 32 | high, t);
      if (is_new) continue;
      const std::uint32_t other = found->second;
      if (std::abs(glm::dot(faces[t].normal, faces[other].normal)) > kRightAngle) continue;
      // Concave: the other face lies on the side to which this one looks. Shells are taken as drawn.
      const glm::dvec3 across =
          mesh.vertices_m[opposite_corner(mesh.triangles[other], low, high)] - mesh.vertices_m[low];
      if (glm::dot(across, faces[t].normal) > 0.0) in_corner[t] = in_corner[other] = 1;
    }
  }
  for (std::size_t t = 0; t < faces.size(); ++t) corner_m2 += in_corner[t] ? faces[t].area_m2 : 0.0;
  if (!(total_m2 > 0.0) || corner_m2 < kShare * total_m2) return {};
  char text[256];
  std::snprintf(text, sizeof text,
                "%.0f %% of the surface lies in concave right angles: corner reflectors answer by "
                "double and triple bounces, which an image of single bounces does not contain",
                100.0 * corner_m2 / total_m2);
  return text;
}

}  // namespace sarnerf
