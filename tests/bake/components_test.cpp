// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <vector>

#include "catch.h"
#include "level_surface.h"
#include "solid_meshes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A closed box of small triangles, so that percentiles of area are those of places.
SurfaceMesh fine_box(const glm::dvec3& min_m, const glm::dvec3& max_m) {
  SurfaceMesh mesh = box_mesh(min_m, max_m);
  for (int n = 0; n < 6; ++n) {
    SurfaceMesh halves;
    halves.vertices_m = mesh.vertices_m;
    for (const glm::uvec3& t : mesh.triangles) {
      const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        halves.vertices_m.push_back(0.5 * (mesh.vertices_m[a] + mesh.vertices_m[b]));
        return static_cast<std::uint32_t>(halves.vertices_m.size() - 1);
      };
      const std::uint32_t xy = middle(t.x, t.y), yz = middle(t.y, t.z), zx = middle(t.z, t.x);
      for (const glm::uvec3& part : {glm::uvec3(t.x, xy, zx), glm::uvec3(t.y, yz, xy), glm::uvec3(t.z, zx, yz), glm::uvec3(xy, yz, zx)})
        halves.triangles.push_back(part);
    }
    mesh = std::move(halves);
  }
  return mesh;
}

}  // namespace

TEST_CASE("the largest component has its own axes, whatever lies beside it") {
  const glm::dvec3 size_m(6.0, 1.5, 2.0);
  for (const double angle_rad : {0.0, 0.7, 2.5}) {
    SurfaceMesh box = fine_box(-0.5 * size_m, 0.5 * size_m);
    for (glm::dvec3& v : box.vertices_m)
      v = {std::cos(angle_rad) * v.x - std::sin(angle_rad) * v.z + 40.0, v.y + 3.0, std::sin(angle_rad) * v.x + std::cos(angle_rad) * v.z};
    const SurfaceMesh mesh = joined(box_mesh(glm::dvec3(0.0), glm::dvec3(1.0, 5.0, 1.0)), box);
    const std::vector<std::uint32_t> component = components_of(mesh);
    CHECK(component.front() == 0);
    const glm::dvec3 found_m = largest_component_m(mesh);
    // Ends hold more than a percent of the area: percentiles are the middles of the outermost triangles.
    for (int axis = 0; axis < 3; ++axis) {
      const double expected_m = axis == 0 ? size_m.x : axis == 1 ? size_m.z : size_m.y;
      CHECK(found_m[axis] == Approx(expected_m).epsilon(0.03));
    }
  }
  CHECK(largest_component_m({}) == glm::dvec3(0.0));
}
