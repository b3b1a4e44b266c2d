// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "../render/voxel_scenes.h"
#include "../scene/files.h"
#include "../scene/solids.h"

/// Meshes that go through a file and all of repair, like a user's.
namespace sarnerf::test {

/// The corners of a box turned by 0.3 rad about the vertical, n as in cube_corner().
inline glm::dvec3 turned_corner(int n, const glm::dvec3& min, const glm::dvec3& size) {
  const glm::dvec3 p = min + cube_corner(n, glm::dvec3(0.0), 1.0) * size;
  const double c = std::cos(0.3), s = std::sin(0.3);
  return {c * p.x + s * p.z, p.y, -s * p.x + c * p.z};
}

using Place = std::function<glm::dvec3(const glm::dvec3&)>;

inline void add_turned_box(ObjBuilder& obj, const glm::dvec3& min, const glm::dvec3& size, const Place& place,
                           bool inverted = false) {
  int first = 0;
  for (int n = 0; n < 8; ++n) {
    const int number = obj.vertex(place(turned_corner(n, min, size)));
    if (n == 0) first = number;
  }
  for (const auto& f : kCubeFaces) obj.triangle(first + f[0], first + f[inverted ? 2 : 1], first + f[inverted ? 1 : 2]);
}

/// A hall with a tower beside it, 12 m across.
inline std::string two_boxes(const Place& place, bool inverted = false) {
  ObjBuilder obj;
  add_turned_box(obj, {-4.0, 0.0, -3.0}, {8.0, 5.0, 6.0}, place, inverted);
  add_turned_box(obj, {4.5, 0.0, -2.0}, {2.0, 8.0, 2.0}, place, inverted);
  return obj.text();
}

inline glm::dvec3 in_place(const glm::dvec3& p) { return p; }

/// The view of all mesh tests: 64 × 64 pixels of 0.3 m from 10 km, scaled and aimed like the scene.
inline Acquisition mesh_view(const glm::dvec3& aim_m = glm::dvec3(0.0), double scale = 1.0) {
  Acquisition a = view_of(40.0, 1e4, 64, 64);
  a.azimuth_rad = 0.5;
  a.aim_m = aim_m;
  a.slant_range_m *= scale;
  a.azimuth_spacing_m *= scale;
  a.range_spacing_m *= scale;
  return a;
}

inline constexpr double kMeshVoxel_m = 0.3;

/// Images of a mesh by both engines; the voxels' lattice begins at the box and moves with it.
struct BothImages {
  Image<float> surface, voxels;
};
inline BothImages both_images(const Scene& scene, const Acquisition& view, double voxel_m = kMeshVoxel_m) {
  return {render_surface(scene, view), render_voxels(scene, view, voxel_m)};
}
inline BothImages both_images(const std::string& obj, const Acquisition& view, double voxel_m = kMeshVoxel_m) {
  return both_images(load_text("mesh.obj", obj), view, voxel_m);
}

/// Larger of the two engines' differences, and the two apart.
struct Differences {
  double surface, voxels;
};
inline Differences differences(const BothImages& found, const BothImages& expected) {
  return {relative_l2(found.surface, expected.surface), relative_l2(found.voxels, expected.voxels)};
}

}  // namespace sarnerf::test
