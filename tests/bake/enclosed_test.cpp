// SPDX-License-Identifier: Apache-2.0
#include "columns.h"

#include "catch.h"
#include "sarnerf/bake/score.h"
#include "sarnerf/core/error.h"
#include "solid_meshes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Columns enclosed(const SurfaceMesh& mesh, const Box& box, double spacing_m) {
  return enclosed_columns(mesh, box, column_lattice(box, spacing_m));
}

const Box kHouseBox{{-4, 0, -3}, {4, 4, 3}};
const SurfaceMesh kHouse = box_mesh(kHouseBox.min, kHouseBox.max);  // of 192 m³

}  // namespace

TEST_CASE("a closed mesh encloses its volume wherever its walls stand between the cells", "[enclosed]") {
  for (const double spacing : {0.25, 0.3, 0.5}) {
    for (const double beyond : {0.0, 0.125, 0.25, 1.0}) {
      const Box box{kHouseBox.min - beyond, kHouseBox.max + beyond};
      const ColumnLattice lattice = column_lattice(box, spacing);
      const Columns filled = enclosed_columns(kHouse, box, lattice), wound = columns_of(kHouse, lattice);
      CHECK(filled.volume_m3() == Approx(wound.volume_m3()));
      CHECK(common_volume_m3(filled, wound) == Approx(wound.volume_m3()));
    }
  }
  const SurfaceMesh sphere = sphere_mesh({0, 2, 0}, 2.0, 4);
  const Box box{{-2, 0, -2}, {2, 4, 2}};
  CHECK(enclosed(sphere, box, 0.05).volume_m3() == Approx(divergence_volume(sphere)).epsilon(2e-3));
}

TEST_CASE("slopes through the cells' centres let no air in", "[enclosed]") {
  // A gabled roof at 45° on walls: its planes meet centres.
  SurfaceMesh house;
  house.vertices_m = {{0, 0, 0}, {8, 0, 0}, {0, 4, 0}, {8, 4, 0}, {4, 8, 0},
                      {0, 0, 8}, {8, 0, 8}, {0, 4, 8}, {8, 4, 8}, {4, 8, 8}};
  house.triangles = {{0, 2, 3}, {0, 3, 1}, {2, 4, 3}, {5, 6, 8}, {5, 8, 7}, {7, 8, 9}, {0, 5, 7}, {0, 7, 2},
                     {1, 3, 8}, {1, 8, 6}, {2, 7, 9}, {2, 9, 4}, {3, 4, 9}, {3, 9, 8}};  // no floor
  const Box box{{0, 0, 0}, {8, 8, 8}};
  for (const double spacing : {0.5, 0.25, 0.2, 1.0}) {
    CHECK(enclosed(house, box, spacing).volume_m3() == Approx(8.0 * (32.0 + 16.0)).epsilon(0.02));
  }
}

TEST_CASE("a house without a floor is filled and one without a roof is not", "[enclosed]") {
  SurfaceMesh no_floor = kHouse, no_roof = kHouse;
  no_floor.triangles.erase(no_floor.triangles.begin() + 4, no_floor.triangles.begin() + 6);
  no_roof.triangles.erase(no_roof.triangles.begin() + 6, no_roof.triangles.begin() + 8);
  CHECK(enclosed(no_floor, kHouseBox, 0.25).volume_m3() == Approx(192.0));
  CHECK(enclosed(inverted(no_floor), kHouseBox, 0.25).volume_m3() == Approx(192.0));
  CHECK(enclosed(no_roof, kHouseBox, 0.25).volume_m3() == 0.0);
}

TEST_CASE("holes narrower than a cell hold the air back", "[enclosed]") {
  // The roof ends a strip before the wall.
  const auto with_gap = [](double gap_m) {
    SurfaceMesh house = kHouse;
    house.triangles.erase(house.triangles.begin() + 6, house.triangles.begin() + 8);
    const auto n = static_cast<std::uint32_t>(house.vertices_m.size());
    for (const double x : {-4.0, 4.0 - gap_m}) {
      for (const double z : {-3.0, 3.0}) house.vertices_m.emplace_back(x, 4.0, z);
    }
    house.triangles.emplace_back(n, n + 1, n + 3);
    house.triangles.emplace_back(n, n + 3, n + 2);
    return house;
  };
  CHECK(enclosed(with_gap(0.1), kHouseBox, 0.25).volume_m3() == Approx(192.0));
  CHECK(enclosed(with_gap(0.6), kHouseBox, 0.25).volume_m3() == 0.0);
}

TEST_CASE("cavities are filled and what is under a table is not", "[enclosed]") {
  CHECK(enclosed(joined(kHouse, inverted(box_mesh({-1, 1, -1}, {1, 2, 1}))), kHouseBox, 0.25).volume_m3() == Approx(192.0));
  const SurfaceMesh table = joined(box_mesh({-4, 3, -3}, {4, 4, 3}), box_mesh({-1, 0, -1}, {1, 3, 1}));
  CHECK(enclosed(table, kHouseBox, 0.25).volume_m3() == Approx(48.0 + 12.0));
}

TEST_CASE("what cannot be filled is refused or empty", "[enclosed]") {
  CHECK(enclosed({}, Box{}, 0.0).volume_m3() == 0.0);
  CHECK(enclosed({}, kHouseBox, 0.5).volume_m3() == 0.0);
  const Box tall{{0, 0, 0}, {1, 1e6, 1}};
  CHECK_THROWS_AS(enclosed(box_mesh(tall.min, tall.max), tall, 0.001), UsageError);
}

TEST_CASE("a truth of thin shells is scored by what it encloses", "[enclosed]") {
  SurfaceMesh shell = kHouse;
  shell.triangles.erase(shell.triangles.begin() + 4, shell.triangles.begin() + 6);
  ScoreOptions options;
  options.n_samples = 1000;
  options.column_spacing_m = 0.125;
  const TruthSurface truth{{}, shell, 0};
  CHECK(score(kHouse, truth, {}, options).iou == 0.0);
  options.truth_volume = TruthVolume::enclosed;
  const SurfaceScore s = score(kHouse, truth, {}, options);
  CHECK(s.iou == Approx(1.0));
  CHECK(s.truth_volume_m3 == Approx(192.0));
  CHECK(s.truth_open_fraction == 0.0);
  CHECK(score(moved(kHouse, {2, 0, 0}), truth, {}, options).iou == Approx(6.0 / 10.0));
}
