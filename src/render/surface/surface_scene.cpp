// SPDX-License-Identifier: Apache-2.0
#include "surface/surface_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <unordered_map>
#include <vector>

#include "sarnerf/scene/scene.h"

namespace sarnerf {

TriangleSubset take_triangles(const Mesh& mesh, std::span<const std::uint32_t> chosen,
                              const glm::dvec3& origin_m) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> new_index(mesh.vertices_m.size(), kUnused);
  TriangleSubset subset;
  subset.triangles.reserve(chosen.size());
  for (const std::uint32_t triangle : chosen) {
    glm::uvec3 corners = mesh.triangles[triangle];
    for (int c = 0; c < 3; ++c) {
      std::uint32_t& index = new_index[corners[c]];
      if (index == kUnused) {
        index = static_cast<std::uint32_t>(subset.vertices_m.size());
        subset.vertices_m.emplace_back(mesh.vertices_m[corners[c]] - origin_m);
      }
      corners[c] = index;
    }
    subset.triangles.push_back(corners);
  }
  subset.vertices_m.emplace_back(0.0f);
  return subset;
}

namespace {

constexpr std::size_t kMaxTriangles = 200'000;
/// |cos| of the angle between two faces below which they count as perpendicular: up to 3 degrees off.
constexpr double kRightAngle = 0.0523;
/// Smallest fraction of the opaque area in such faces that triggers the warning.
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

/// One line when much of the mesh is made of faces that meet in concave right angles: dihedral and
/// trihedral corner reflectors scatter by double and triple bounces, which an image of single bounces
/// lacks. Empty otherwise. Meshes of more than 200,000 triangles are not examined: they are usually scans
/// and not drawings with exact corners.
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
      // Concave: the other face lies on the side of this face's normal. Shells keep the winding they were drawn with.
      const glm::dvec3 across =
          mesh.vertices_m[opposite_corner(mesh.triangles[other], low, high)] - mesh.vertices_m[low];
      if (glm::dot(across, faces[t].normal) > 0.0) in_corner[t] = in_corner[other] = 1;
    }
  }
  for (std::size_t t = 0; t < faces.size(); ++t) corner_m2 += in_corner[t] ? faces[t].area_m2 : 0.0;
  if (!(total_m2 > 0.0) || corner_m2 < kShare * total_m2) return {};
  char text[256];
  std::snprintf(text, sizeof text,
                "%.0f %% of the surface lies in concave right angles: corner reflectors scatter by "
                "double and triple bounces, which an image of single bounces does not contain",
                100.0 * corner_m2 / total_m2);
  return text;
}

std::vector<std::uint32_t> opaque_triangles(const Scene& scene) {
  std::vector<std::uint32_t> chosen;
  chosen.reserve(scene.mesh.triangles.size());
  for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    if (scene.materials[scene.mesh.material[t]].opaque) chosen.push_back(t);
  }
  return chosen;
}

}  // namespace

SurfaceScene::SurfaceScene(const Scene& s)
    : scene(s), origin_m(s.box.empty() ? glm::dvec3(0.0) : s.box.centre()), media(s, origin_m) {
  const std::vector<std::uint32_t> chosen = opaque_triangles(s);
  appearances = make_appearances(s, chosen, origin_m);
  opaque = take_triangles(s.mesh, chosen, origin_m);
  tracer = std::make_unique<RayTracer>(vertices(opaque.vertices_m), opaque.triangles);
  if (std::string corners = corner_reflector_warning(s); !corners.empty()) {
    warnings.push_back(std::move(corners));
  }
}

std::span<const Component> SurfaceScene::components() const {
  std::call_once(components_found_, [&] {
    const std::vector<Component> all = components_of_triangles(scene);
    for (const std::uint32_t t : opaque_triangles(scene)) components_.push_back(all[t]);
  });
  return components_;
}

std::uint64_t SurfaceScene::memory_bytes() const {
  return tracer->memory_bytes() + media.memory_bytes() + opaque.vertices_m.size() * sizeof(glm::vec3) +
         opaque.triangles.size() * (sizeof(glm::uvec3) + sizeof(std::uint16_t));
}

}  // namespace sarnerf
