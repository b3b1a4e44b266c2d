// SPDX-License-Identifier: Apache-2.0
#include "columns.h"

#include <cmath>
#include <random>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"
#include "solid_meshes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Lines at 0, 1, 2 … 15 along both axes.
constexpr ColumnLattice kUnitLines{-0.5, -0.5, 1.0, 16, 16};

double volume(const SurfaceMesh& mesh, const ColumnLattice& lattice) { return columns_of(mesh, lattice).volume_m3(); }

}  // namespace

TEST_CASE("a box between the lines has its volume and so has one whose walls stand on lines", "[columns]") {
  for (const double offset : {0.5, 1.0}) {
    const SurfaceMesh box = box_mesh({offset + 1.0, -2.0, offset + 2.0}, {offset + 5.0, 5.0, offset + 8.0});
    const Columns columns = columns_of(box, kUnitLines);
    CHECK(columns.volume_m3() == 4.0 * 7.0 * 6.0);
    CHECK(columns.intervals.size() == 24);
    CHECK(columns.n_met == 24);
    CHECK(columns.n_open == 0);
    for (const Columns::Interval& interval : columns.intervals) {
      CHECK(interval.bottom_m == -2.0);
      CHECK(interval.top_m == 5.0);
    }
  }
}

TEST_CASE("solids side by side leave no gap and no overlap on lines along their common wall", "[columns]") {
  const SurfaceMesh a = box_mesh({1.0, 0.0, 1.0}, {4.0, 1.0, 9.0}), b = box_mesh({4.0, 0.0, 1.0}, {9.0, 1.0, 9.0});
  CHECK(volume(a, kUnitLines) == 24.0);
  CHECK(volume(b, kUnitLines) == 40.0);
  CHECK(volume(joined(a, b), kUnitLines) == 64.0);
  CHECK(common_volume_m3(columns_of(a, kUnitLines), columns_of(b, kUnitLines)) == 0.0);
}

TEST_CASE("lines through corners of a fan cross it once", "[columns]") {
  // A pyramid and its mirror image: the apex and many edges lie on lines.
  SurfaceMesh mesh;
  mesh.vertices_m = {{2, 0, 2}, {10, 0, 2}, {10, 0, 10}, {2, 0, 10}, {6, 4, 6}, {6, -4, 6}};
  for (std::uint32_t n = 0; n < 4; ++n) {
    mesh.triangles.emplace_back(4, (n + 1) % 4, n);
    mesh.triangles.emplace_back(5, n, (n + 1) % 4);
  }
  REQUIRE(divergence_volume(mesh) == Approx(2.0 * 64.0 * 4.0 / 3.0));
  const Columns columns = columns_of(mesh, kUnitLines);
  CHECK(columns.n_open == 0);
  for (const Columns::Interval& interval : columns.intervals) {
    CHECK(interval.top_m == within_margin(-interval.bottom_m, 1e-12));
  }
  double at_apex = 0.0;
  for (std::size_t n = columns.row_begin[6]; n < columns.row_begin[7]; ++n) {
    if (columns.intervals[n].i == 6) at_apex += columns.intervals[n].top_m - columns.intervals[n].bottom_m;
  }
  CHECK(at_apex == Approx(8.0));
}

TEST_CASE("every line closes whatever the mesh and the lattice", "[columns]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int n = 0; n < 40; ++n) {
    // Vertices on a coarse raster, so that lines meet edges, corners, walls and triangles without area.
    SurfaceMesh mesh = sphere_mesh({8, 8, 8}, 6.0, 2);
    const double raster = n % 2 == 0 ? 0.5 : 0.1;
    for (glm::dvec3& v : mesh.vertices_m) v = raster * glm::round(v / raster);
    const ColumnLattice lattice{0.25 * (n % 4), raster * (n % 3), raster, 160, 160};
    CHECK(columns_of(mesh, lattice).n_open == 0);
    // Turned by any angle, with the same corners written twice.
    const double turn = unit(random);
    SurfaceMesh split;
    for (const glm::uvec3& t : mesh.triangles) {
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 p = mesh.vertices_m[t[c]] - 8.0;
        split.vertices_m.emplace_back(std::cos(turn) * p.x - std::sin(turn) * p.z + 8.0, p.y,
                                      std::sin(turn) * p.x + std::cos(turn) * p.z + 8.0);
      }
      const auto last = static_cast<std::uint32_t>(split.vertices_m.size() - 1);
      split.triangles.emplace_back(last - 2, last - 1, last);
    }
    CHECK(columns_of(split, lattice).n_open == 0);
  }
}

TEST_CASE("a sphere's volume converges with the spacing", "[columns]") {
  const SurfaceMesh sphere = sphere_mesh({0.3, 1.0, -0.2}, 1.0, 5);
  const Box box{{-0.7, 0.0, -1.2}, {1.3, 2.0, 0.8}};
  const double expected = divergence_volume(sphere);
  CHECK(expected == Approx(4.0 / 3.0 * kPi).epsilon(2e-3));
  CHECK(volume(sphere, column_lattice(box, 0.0)) == Approx(expected).epsilon(1e-4));
  CHECK(volume(sphere, column_lattice(box, 0.05)) == Approx(expected).epsilon(1e-2));
}

TEST_CASE("overlapping pieces count once and cavities stay empty", "[columns]") {
  const SurfaceMesh a = cube_mesh({1.5, 0.0, 1.5}, 6.0);
  CHECK(volume(joined(a, cube_mesh({4.5, 0.0, 1.5}, 6.0)), kUnitLines) == 9.0 * 6.0 * 6.0);
  CHECK(volume(joined(a, a), kUnitLines) == 216.0);
  CHECK(volume(joined(a, cube_mesh({3.5, 1.0, 3.5}, 2.0)), kUnitLines) == 216.0);
  CHECK(volume(joined(a, inverted(cube_mesh({3.5, 1.0, 3.5}, 2.0))), kUnitLines) == 208.0);
  CHECK(volume(joined(a, moved(a, {0, 6, 0})), kUnitLines) == 432.0);  // one on the other
}

TEST_CASE("an inverted mesh holds nothing and an open one says so", "[columns]") {
  const SurfaceMesh cube = cube_mesh({1.5, 0.0, 1.5}, 6.0);
  CHECK(volume(inverted(cube), kUnitLines) == 0.0);
  CHECK(columns_of(inverted(cube), kUnitLines).n_open == 0);

  SurfaceMesh open = cube;
  // Half of the top is missing: 15 of the 36 lines lie on one side of the diagonal, 6 on it.
  open.triangles.erase(open.triangles.begin() + 6);
  const Columns columns = columns_of(open, kUnitLines);
  CHECK(columns.n_met == 36);
  CHECK(columns.n_open >= 15);
  CHECK(columns.n_open <= 21);
  CHECK(columns.volume_m3() == Approx(216.0 * (1.0 - double(columns.n_open) / 36.0)));
}

TEST_CASE("common volume of boxes is that of their intersection", "[columns]") {
  const Columns a = columns_of(box_mesh({1.5, 0.0, 1.5}, {7.5, 5.0, 7.5}), kUnitLines);
  const Columns b = columns_of(box_mesh({3.5, 2.0, 4.5}, {12.5, 9.0, 12.5}), kUnitLines);
  CHECK(common_volume_m3(a, b) == 4.0 * 3.0 * 3.0);
  CHECK(common_volume_m3(b, a) == common_volume_m3(a, b));
  CHECK(common_volume_m3(a, a) == a.volume_m3());
  // Two storeys against the floor between them.
  const Columns storeys = columns_of(
      joined(box_mesh({1.5, 0.0, 1.5}, {7.5, 2.0, 7.5}), box_mesh({1.5, 3.0, 1.5}, {7.5, 5.0, 7.5})), kUnitLines);
  CHECK(common_volume_m3(a, storeys) == 36.0 * 4.0);
  CHECK(common_volume_m3(storeys, columns_of(box_mesh({1.5, 1.5, 1.5}, {7.5, 4.0, 7.5}), kUnitLines)) == 36.0 * 1.5);
}

TEST_CASE("lattices fit their box and refuse nonsense", "[columns]") {
  const Box box{{-10.0, 0.0, 5.0}, {30.0, 3.0, 15.0}};
  const ColumnLattice chosen = column_lattice(box, 0.0);
  CHECK(chosen.n_x == 512);
  CHECK(chosen.n_z == 128);
  const ColumnLattice given = column_lattice(box, 0.3);
  CHECK(given.n_x == 134);
  CHECK(given.n_z == 34);
  CHECK(column_lattice(Box{}, 0.0).n_x == 0);
  CHECK(columns_of({}, column_lattice(Box{}, 0.0)).volume_m3() == 0.0);
  CHECK(column_lattice({{1, 1, 1}, {1, 1, 1}}, 0.0).n_x == 1);
  CHECK_THROWS_AS(column_lattice(box, -1.0), UsageError);
  CHECK_THROWS_AS(column_lattice(box, std::nan("")), UsageError);
  CHECK_THROWS_AS(column_lattice(box, 1e-3), UsageError);
}
