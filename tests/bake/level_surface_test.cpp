// SPDX-License-Identifier: Apache-2.0
#include "level_surface.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "surface_checks.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

openvdb::FloatGrid::Ptr empty_grid(double voxel_size_m, const glm::dvec3& origin_m = glm::dvec3(0.0)) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_size_m);
  transform->postTranslate({origin_m.x, origin_m.y, origin_m.z});
  grid->setTransform(transform);
  return grid;
}

/// Rises from 0 to 1 over two voxels across a surface of the given signed distance, in voxels.
openvdb::FloatGrid::Ptr ramp(int reach, double voxel_size_m, const glm::dvec3& origin_m,
                             const std::function<double(const glm::dvec3&)>& distance) {
  const auto grid = empty_grid(voxel_size_m, origin_m);
  auto accessor = grid->getAccessor();
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y)
      for (int z = -reach; z <= reach; ++z) {
        const double occupancy = std::clamp(0.5 - 0.5 * distance({x, y, z}), 0.0, 1.0);
        if (occupancy > 0.0) accessor.setValue({x, y, z}, static_cast<float>(occupancy));
      }
  return grid;
}

openvdb::FloatGrid::Ptr sphere(double radius, double voxel_size_m, const glm::dvec3& origin_m = glm::dvec3(0.0)) {
  return ramp(static_cast<int>(radius) + 3, voxel_size_m, origin_m,
              [=](const glm::dvec3& p) { return glm::length(p - glm::dvec3(0.3, 0.1, -0.2)) - radius; });
}

void check_closed(const SurfaceMesh& mesh) {
  const EdgeCounts edges = edge_counts(mesh);
  CHECK(edges.open == 0);
  CHECK(edges.repeated == 0);
  CHECK(is_tidy(mesh));
}

}  // namespace

TEST_CASE("a sphere has the volume and the area of one") {
  double last_error = 1.0;
  for (const double radius : {6.0, 12.0, 24.0}) {
    const SurfaceMesh mesh = level_surface(*sphere(radius, 2.0 / radius));
    const double volume = signed_volume_m3(mesh) / (4.0 / 3.0 * kPi * 8.0), area = area_m2(mesh) / (4.0 * kPi * 4.0);
    INFO("radius " << radius << " voxels: volume " << volume << " and area " << area << " of the sphere's");
    check_closed(mesh);
    CHECK(euler_characteristic(mesh) == 2);
    const double error = std::abs(volume - 1.0);
    CHECK(error < 1.2 / (radius * radius));
    CHECK(error < 0.4 * last_error);  // second order
    CHECK(area == Approx(1.0).margin(1.0 / (radius * radius)));
    last_error = error;
  }
}

TEST_CASE("every triangle of a sphere looks outward") {
  const SurfaceMesh mesh = level_surface(*sphere(10.0, 1.0));
  int n_inward = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.x], b = mesh.vertices_m[t.y], c = mesh.vertices_m[t.z];
    n_inward += glm::dot(glm::cross(b - a, c - a), (a + b + c) / 3.0 - glm::dvec3(0.3, 0.1, -0.2)) > 0.0 ? 0 : 1;
  }
  CHECK(n_inward == 0);
}

TEST_CASE("faces of a box lie where linear interpolation puts them") {
  // Occupancy 0.25 in the outermost centres, 1 within: 0.5 is crossed a third of a voxel inside of them.
  const glm::ivec3 last(5, 7, 4);
  const auto grid = empty_grid(0.5);
  auto accessor = grid->getAccessor();
  for (int x = -last.x; x <= last.x; ++x)
    for (int y = -last.y; y <= last.y; ++y)
      for (int z = -last.z; z <= last.z; ++z) {
        const bool outermost = std::abs(x) == last.x || std::abs(y) == last.y || std::abs(z) == last.z;
        accessor.setValue({x, y, z}, outermost ? 0.25f : 1.0f);
      }
  const SurfaceMesh mesh = level_surface(*grid);
  check_closed(mesh);
  CHECK(euler_characteristic(mesh) == 2);
  const Box box = box_m(mesh);
  const glm::dvec3 expected_m = 0.5 * (glm::dvec3(last) - 1.0 / 3.0);
  for (int axis = 0; axis < 3; ++axis) {
    CHECK(box.max[axis] == Approx(expected_m[axis]).margin(0.5 / 1024));
    CHECK(box.min[axis] == Approx(-expected_m[axis]).margin(0.5 / 1024));
  }
}

TEST_CASE("a box of full voxels loses only its edges") {
  const glm::dvec3 size(20.0, 12.0, 16.0);  // voxels of 1 m
  const auto grid = empty_grid(1.0);
  grid->fill(openvdb::CoordBBox({0, 0, 0}, {19, 11, 15}), 1.0f);
  const SurfaceMesh mesh = level_surface(*grid);
  check_closed(mesh);
  CHECK(euler_characteristic(mesh) == 2);
  CHECK(box_m(mesh).min == glm::dvec3(-0.5));
  CHECK(box_m(mesh).max == size - 0.5);
  // The vertex of a cell along an edge lies a quarter of a voxel from the last centres, the mean of two crossings, and
  // its neighbours half a voxel before the edge's end: 1/4 of a voxel's section is missing. Corners matter less.
  const double edges = 4.0 * (size.x + size.y + size.z), full = size.x * size.y * size.z;
  CHECK(signed_volume_m3(mesh) == Approx(full - edges / 4.0).margin(4.0));
}

TEST_CASE("tiles are solid whether they are active or not") {
  const auto leaves = empty_grid(0.1), active = empty_grid(0.1), inactive = empty_grid(0.1);
  leaves->fill(openvdb::CoordBBox({0, 0, 0}, {23, 15, 15}), 1.0f);
  leaves->tree().voxelizeActiveTiles();
  for (const int x : {0, 8, 16})
    for (const int y : {0, 8})
      for (const int z : {0, 8}) {
        active->tree().addTile(1, {x, y, z}, 1.0f, true);
        inactive->tree().addTile(1, {x, y, z}, 1.0f, false);
      }
  const SurfaceMesh expected = level_surface(*leaves);
  check_closed(expected);
  for (const auto& grid : {active, inactive}) {
    const SurfaceMesh mesh = level_surface(*grid);
    check_closed(mesh);
    CHECK(mesh.vertices_m.size() == expected.vertices_m.size());
    CHECK(signed_volume_m3(mesh) == Approx(signed_volume_m3(expected)));
  }
  CHECK(inactive->activeVoxelCount() == 0);  // as it was
}

TEST_CASE("a higher level is crossed further inside") {
  const auto grid = sphere(10.0, 1.0);
  const double low = signed_volume_m3(level_surface(*grid, 0.25)), high = signed_volume_m3(level_surface(*grid, 0.75));
  CHECK(low == Approx(4.0 / 3.0 * kPi * std::pow(10.5, 3)).epsilon(0.02));
  CHECK(high == Approx(4.0 / 3.0 * kPi * std::pow(9.5, 3)).epsilon(0.02));
}

TEST_CASE("surfaces far from the origin keep their millimetres") {
  const glm::dvec3 utm_m(500123.25, 31.5, -4212345.75);
  const SurfaceMesh here = level_surface(*sphere(10.0, 0.125)), there = level_surface(*sphere(10.0, 0.125, utm_m));
  REQUIRE(there.vertices_m.size() == here.vertices_m.size());
  CHECK((there.triangles == here.triangles));
  CHECK(is_tidy(there));
  double worst_m = 0.0;
  for (std::size_t v = 0; v < here.vertices_m.size(); ++v)
    worst_m = worse(worst_m, glm::length(there.vertices_m[v] - utm_m - here.vertices_m[v]));
  CHECK(worst_m < 1e-8);

  // The same far away in indices: float32 would have lost a sixteenth of a voxel.
  const auto shifted = empty_grid(0.125);
  auto accessor = shifted->getAccessor();
  const auto unshifted = sphere(10.0, 0.125);
  for (auto voxel = unshifted->cbeginValueOn(); voxel; ++voxel)
    accessor.setValue(voxel.getCoord() + openvdb::Coord(1 << 20, 0, 0), *voxel);
  CHECK(signed_volume_m3(level_surface(*shifted)) == Approx(signed_volume_m3(here)).epsilon(1e-9));
}

TEST_CASE("noise has a closed surface") {
  for (const bool binary : {false, true}) {
    std::mt19937 random(binary ? 1u : 2u);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    const auto grid = empty_grid(1.0);
    auto accessor = grid->getAccessor();
    for (int x = 0; x < 20; ++x)
      for (int y = 0; y < 20; ++y)
        for (int z = 0; z < 20; ++z) {
          const float value = uniform(random);
          accessor.setValue({x, y, z}, binary ? (value < 0.4f ? 1.0f : 0.0f) : value);
        }
    const SurfaceMesh mesh = level_surface(*grid);
    const EdgeCounts edges = edge_counts(mesh);
    INFO((binary ? "binary" : "smooth") << ": " << edges.edges << " edges, " << edges.repeated << " of four triangles");
    CHECK(edges.open == 0);
    CHECK(edges.repeated == 0);
    CHECK(is_tidy(mesh));
    CHECK(signed_volume_m3(mesh) > 0.0);
  }
}

TEST_CASE("occupancies equal to the level leave no holes") {
  const auto grid = empty_grid(1.0);
  auto accessor = grid->getAccessor();
  std::mt19937 random(3);
  for (int x = 0; x < 16; ++x)
    for (int y = 0; y < 16; ++y)
      for (int z = 0; z < 16; ++z) accessor.setValue({x, y, z}, 0.5f * static_cast<float>(random() % 3));
  const SurfaceMesh mesh = level_surface(*grid);
  INFO(edge_counts(mesh).repeated << " of " << edge_counts(mesh).edges << " edges have four triangles");
  CHECK(edge_counts(mesh).open == 0);
  CHECK(is_tidy(mesh));
}

TEST_CASE("surfaces do not depend on the number of threads") {
  const auto grid = sphere(20.0, 0.1);
  const SurfaceMesh mesh = level_surface(*grid);
  const ThreadLimit one(1);
  const SurfaceMesh alone = level_surface(*grid);
  CHECK((alone.vertices_m == mesh.vertices_m));
  CHECK((alone.triangles == mesh.triangles));
}

TEST_CASE("an occupancy without matter has no surface") {
  CHECK(level_surface(*empty_grid(1.0)).triangles.empty());
  const SurfaceMesh mesh = level_surface(*sphere(5.0, 1.0), 1.5);
  CHECK(mesh.triangles.empty());
  CHECK(mesh.vertices_m.empty());
}

TEST_CASE("an occupancy that is not finite has no surface either") {
  const auto grid = sphere(5.0, 1.0);
  grid->getAccessor().setValue({3, 4, 0}, std::numeric_limits<float>::quiet_NaN());
  CHECK_THROWS_AS(level_surface(*grid), NumericsError);
}
