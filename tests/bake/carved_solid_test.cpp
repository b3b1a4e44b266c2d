// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/extract.h"

#include <atomic>
#include <cmath>
#include <random>

#include "level_surface.h"
#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "surface_checks.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// 64 × 64 pixels of 0.25 m, seen from 2 km.
Acquisition seen_from(double azimuth_deg, double incidence_deg = 45.0, const glm::dvec3& aim_m = glm::dvec3(0.0)) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(azimuth_deg);
  a.incidence_rad = rad_from_deg(incidence_deg);
  a.slant_range_m = 2000.0;
  a.aim_m = aim_m;
  a.n_azimuth = a.n_range = 64;
  a.azimuth_spacing_m = a.range_spacing_m = 0.25;
  return a;
}

PosedImage flat(const Acquisition& a, float value) {
  return {"flat", a, Image<float>(a.n_azimuth, a.n_range, value)};
}

/// Bright wherever a surface point of a box that stands on y = 0 of the aim point projects to.
PosedImage image_of_box(const Acquisition& a, const glm::dvec3& size_m) {
  PosedImage image = flat(a, 0.0f);
  const RadarFrame frame = radar_frame(a);
  constexpr int kSteps = 120;
  int n_outside = 0;
  for (int face = 0; face < 6; ++face) {
    for (int n = 0; n <= kSteps * (kSteps + 2); ++n) {
      glm::dvec3 unit(face % 2);  // in [0, 1]³
      unit[(face / 2 + 1) % 3] = static_cast<double>(n / (kSteps + 1)) / kSteps;
      unit[(face / 2 + 2) % 3] = static_cast<double>(n % (kSteps + 1)) / kSteps;
      const RadarPoint p = project(a, frame, a.aim_m + size_m * (unit - glm::dvec3(0.5, 0.0, 0.5)));
      const auto i = static_cast<int>(std::lround(p.along_track_m / a.azimuth_spacing_m + 0.5 * (a.n_azimuth - 1)));
      const auto j = static_cast<int>(std::lround(p.range_offset_m / a.range_spacing_m + 0.5 * (a.n_range - 1)));
      n_outside += i >= 0 && i < a.n_azimuth && j >= 0 && j < a.n_range ? 0 : 1;
      if (n_outside == 0) image.power(i, j) = 1.0f;
    }
  }
  REQUIRE(n_outside == 0);
  return image;
}

std::vector<PosedImage> images_of_box(const glm::dvec3& size_m, const glm::dvec3& aim_m = glm::dvec3(0.0)) {
  std::vector<PosedImage> images;
  for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 15)
    for (const double incidence_deg : {35.0, 55.0})
      images.push_back(image_of_box(seen_from(azimuth_deg, incidence_deg, aim_m), size_m));
  return images;
}

Box box_around(const glm::dvec3& centre_m, const glm::dvec3& half_m) {
  Box box;
  box.include(centre_m - half_m);
  box.include(centre_m + half_m);
  return box;
}

/// The definition, by the projection that everything else uses.
bool is_full(std::span<const PosedImage> images, const glm::dvec3& point_m, double zero_level) {
  bool seen = false;
  for (const PosedImage& image : images) {
    const Acquisition& a = image.acquisition;
    const RadarPoint p = project(a, radar_frame(a), point_m);
    const double i = std::floor(p.along_track_m / a.azimuth_spacing_m + 0.5 * a.n_azimuth);
    if (i < 0 || i >= a.n_azimuth) continue;
    if (p.range_offset_m < a.bin_offset_m(-0.5) || p.range_offset_m > a.bin_offset_m(a.n_range - 0.5)) continue;
    int j = 0;
    while (j < a.n_range && double{image.power(static_cast<int>(i), j)} <= zero_level) ++j;
    if (j == a.n_range || p.range_offset_m < a.bin_offset_m(j - 0.5)) return false;
    seen = true;
  }
  return seen;
}

}  // namespace

TEST_CASE("voxels are carved as defined") {
  const glm::dvec3 aim_m(5e5, 30.0, -4e6);
  std::mt19937 random(5);
  std::vector<PosedImage> images;
  for (const double azimuth_deg : {10.0, 100.0, 215.0, 300.0}) {
    PosedImage image = flat(seen_from(azimuth_deg, 40.0 + 0.05 * azimuth_deg, aim_m), 0.0f);
    if (azimuth_deg > 200.0) image.acquisition.look = Look::left;
    for (int i = 0; i < 64; ++i)
      for (auto j = static_cast<int>(random() % 60); j < 64; ++j)
        image.power(i, j) = 10.0f * std::pow(10.0f, -static_cast<float>(random() % 9));
    images.push_back(std::move(image));
  }
  const CarvingLattice lattice{box_around(aim_m, {11.0, 6.0, 11.0}), 0.5};
  const auto grid = carved_occupancy(images, lattice, std::nullopt, {});
  const auto accessor = grid->getConstAccessor();
  int n_different = 0, n_full = 0;
  for (int x = -1; x <= 44; ++x)
    for (int y = -1; y <= 24; ++y)
      for (int z = -1; z <= 44; ++z) {
        const bool inside = x >= 0 && x < 44 && y >= 0 && y < 24 && z >= 0 && z < 44;
        const glm::dvec3 point_m = lattice.box_m.min + 0.5 * (glm::dvec3(x, y, z) + 0.5);
        const bool full = inside && is_full(images, point_m, 1e-5);
        n_different += (accessor.getValue({x, y, z}) == 1.0f) != full ? 1 : 0;
        n_full += full ? 1 : 0;
      }
  CHECK(n_different == 0);
  CHECK(n_full > 1000);
  CHECK(n_full < 40 * 40 * 20);
}

TEST_CASE("a box is left with little around it") {
  const glm::dvec3 size_m(5.0, 4.0, 3.0);
  const CarvingLattice lattice{box_around({0.0, 2.0, 0.0}, {4.0, 4.0, 4.0}), 0.125};
  const std::vector<PosedImage> images = images_of_box(size_m);
  const SurfaceMesh mesh = carved_solid(images, lattice, 0.0);
  CHECK(edge_counts(mesh).open == 0);
  CHECK(is_tidy(mesh));
  const Box box = box_m(mesh);
  CHECK(box.min.y == Approx(0.0).margin(1e-9));
  // Views around it see each side against nothing, to a pixel and a voxel.
  for (const int axis : {0, 2}) {
    CHECK(box.max[axis] >= 0.5 * size_m[axis] - 0.07);
    CHECK(box.max[axis] <= 0.5 * size_m[axis] + 0.45);
  }
  CHECK(signed_volume_m3(mesh) > 60.0);
  CHECK(signed_volume_m3(mesh) < 100.0);

  // No voxel of the box is lost.
  const auto grid = carved_occupancy(images, lattice, 0.0, {});
  int n_lost = 0;
  for (int x = 0; x < 64; ++x)
    for (int y = 0; y < 64; ++y)
      for (int z = 0; z < 64; ++z) {
        const glm::dvec3 p = lattice.box_m.min + 0.125 * (glm::dvec3(x, y, z) + 0.5);
        const bool inside = std::abs(p.x) < 2.5 && p.y > 0.0 && p.y < 4.0 && std::abs(p.z) < 1.5;
        n_lost += inside && grid->tree().getValue({x, y, z}) != 1.0f ? 1 : 0;
      }
  CHECK(n_lost == 0);
}

TEST_CASE("one point leaves a thin pillar under itself") {
  const glm::dvec3 point_m(1.0, 1.5, -2.0);
  std::vector<PosedImage> images;
  for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 10) {
    PosedImage image = flat(seen_from(azimuth_deg), 0.0f);
    const RadarPoint p = project(image.acquisition, radar_frame(image.acquisition), point_m);
    const auto i = static_cast<int>(std::lround(p.along_track_m / 0.25 + 31.5));
    const auto j = static_cast<int>(std::lround(p.range_offset_m / 0.25 + 31.5));
    // Rows beside it as well: it may lie at the edge of its own.
    for (const int row : {i - 1, i, i + 1}) image.power(row, j) = 1e-3f;
    images.push_back(std::move(image));
  }
  const Box box = box_m(carved_solid(images, {box_around(point_m, glm::dvec3(3.0)), 0.0625}, 0.0));
  CHECK(box.min.y == Approx(0.0).margin(1e-9));
  CHECK(box.max.y == Approx(point_m.y).margin(0.45));  // a pixel seen at 45°
  for (const int axis : {0, 2}) {
    CHECK(box.centre()[axis] == Approx(point_m[axis]).margin(0.15));
    CHECK(box.size()[axis] > 0.4);
    CHECK(box.size()[axis] < 0.8);
  }
}

TEST_CASE("images without returns leave nothing") {
  const CarvingLattice lattice{box_around(glm::dvec3(0.0), glm::dvec3(5.0)), 0.5};
  const std::vector<PosedImage> dark = {flat(seen_from(0.0), 0.0f), flat(seen_from(90.0), 0.0f)};
  CHECK(carved_solid(dark, lattice).triangles.empty());
  CHECK(carved_solid({}, lattice).triangles.empty());
  // One dark view empties what the other one would have left.
  const std::vector<PosedImage> half_dark = {flat(seen_from(0.0), 1.0f), flat(seen_from(90.0), 0.0f)};
  CHECK(carved_solid(half_dark, lattice).triangles.empty());
}

TEST_CASE("what no view sees is empty") {
  // 16 m along X and 16 m of slant range, in a box of 40 m.
  const std::vector<PosedImage> images = {flat(seen_from(0.0), 1.0f)};
  const CarvingLattice lattice{box_around(glm::dvec3(0.0), {20.0, 1.0, 20.0}), 0.5};
  const Box box = box_m(carved_solid(images, lattice));
  CHECK(box.min.x == Approx(-8.0));
  CHECK(box.max.x == Approx(8.0));
  CHECK(box.size().y == Approx(2.0));
  // Range along Z at height 0 is 16 m / sin 45°, and 2 m more over the box's height, cut at voxels.
  CHECK(box.size().z == Approx(16.0 * std::sqrt(2.0) + 2.0).margin(1.0));
}

TEST_CASE("below the ground is empty") {
  const std::vector<PosedImage> images = {flat(seen_from(0.0), 1.0f)};
  const CarvingLattice lattice{box_around(glm::dvec3(0.0), glm::dvec3(4.0)), 0.5};
  CHECK(box_m(carved_solid(images, lattice)).min.y == Approx(-4.0));
  CHECK(box_m(carved_solid(images, lattice, 1.0)).min.y == Approx(1.0));
  CHECK(carved_solid(images, lattice, 5.0).triangles.empty());
}

TEST_CASE("solids go with the frame of their images") {
  const glm::dvec3 size_m(5.0, 4.0, 3.0), aim_m(524288.0, 32.0, -4194304.0);
  const CarvingLattice here{box_around({0.0, 2.0, 0.0}, glm::dvec3(4.0)), 0.25};
  const CarvingLattice there{box_around(aim_m + glm::dvec3(0.0, 2.0, 0.0), glm::dvec3(4.0)), 0.25};
  const SurfaceMesh a = carved_solid(images_of_box(size_m), here, 0.0);
  const SurfaceMesh b = carved_solid(images_of_box(size_m, aim_m), there, aim_m.y);
  REQUIRE(a.vertices_m.size() == b.vertices_m.size());
  CHECK((a.triangles == b.triangles));
  double worst_m = 0.0;
  for (std::size_t v = 0; v < a.vertices_m.size(); ++v)
    worst_m = worse(worst_m, glm::length(b.vertices_m[v] - aim_m - a.vertices_m[v]));
  CHECK(worst_m < 1e-8);
}

TEST_CASE("a solid is the same on one thread and stops when asked") {
  const CarvingLattice lattice{box_around({0.0, 2.0, 0.0}, glm::dvec3(4.0)), 0.125};
  const std::vector<PosedImage> images = images_of_box({5.0, 4.0, 3.0});
  const SurfaceMesh mesh = carved_solid(images, lattice, 0.0);
  const ThreadLimit one(1);
  const SurfaceMesh alone = carved_solid(images, lattice, 0.0);
  CHECK((alone.vertices_m == mesh.vertices_m));
  CHECK((alone.triangles == mesh.triangles));

  Monitor monitor;
  std::atomic<bool> stop = true;
  monitor.stop = &stop;
  CHECK_THROWS_AS(carved_solid(images, lattice, 0.0, monitor), Interrupted);
}

TEST_CASE("lattices without voxels or with too many are refused") {
  const std::vector<PosedImage> images = {flat(seen_from(0.0), 1.0f)};
  const Box box = box_around(glm::dvec3(0.0), glm::dvec3(4.0));
  CHECK_THROWS_AS(carved_solid(images, {Box(), 0.5}), UsageError);
  CHECK_THROWS_AS(carved_solid(images, {box, 0.0}), UsageError);
  CHECK_THROWS_AS(carved_solid(images, {box, std::nan("")}), UsageError);
  CHECK_THROWS_AS(carved_solid(images, {box, 1e-7}), UsageError);
}
