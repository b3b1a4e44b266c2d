// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/score.h"

#include <atomic>
#include <cmath>
#include <limits>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "solid_meshes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

ScoreOptions quick(double column_spacing_m = 0.0) {
  ScoreOptions options;
  options.column_spacing_m = column_spacing_m;
  options.n_samples = 20'000;
  return options;
}

SurfaceScore score_of(const SurfaceMesh& extracted, const SurfaceMesh& truth, double column_spacing_m = 0.0) {
  return score(extracted, solid_truth(truth), {}, quick(column_spacing_m));
}

}  // namespace

TEST_CASE("a box against itself scores best", "[score]") {
  const SurfaceMesh box = box_mesh({-3, 0, -4}, {5, 6, 2});
  const SurfaceScore s = score_of(box, box);
  CHECK(s.iou == 1.0);
  CHECK(s.precision == 1.0);
  CHECK(s.recall == 1.0);
  CHECK(s.volume_m3 == Approx(288.0));
  CHECK(s.truth_volume_m3 == s.volume_m3);
  CHECK(s.volume_error == 0.0);
  CHECK(s.box_min_error_m == glm::dvec3(0.0));
  CHECK(s.box_max_error_m == glm::dvec3(0.0));
  CHECK(s.size_ratio == 1.0);
  CHECK(s.whole.chamfer_m == Approx(0.0).margin(1e-12));
  CHECK(s.whole.hausdorff_m == Approx(0.0).margin(1e-12));
  CHECK(s.open_fraction == 0.0);
  CHECK(s.column_spacing_m == 8.0 / 512);
  // Without views.
  CHECK(s.visible_fraction == 0.0);
  CHECK(std::isnan(s.visible.chamfer_m));
}

TEST_CASE("a shifted cube has the overlap and the distances of its closed form", "[score]") {
  constexpr double kSide = 8.0, kShift = 1.0;
  const SurfaceMesh truth = cube_mesh({0, 0, 0}, kSide);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 shift(0.0);
    shift[axis] = kShift;
    const SurfaceScore s = score_of(moved(truth, shift), truth, 0.0625);
    CHECK(s.iou == Approx((kSide - kShift) / (kSide + kShift)));
    CHECK(s.precision == Approx((kSide - kShift) / kSide));
    CHECK(s.recall == Approx((kSide - kShift) / kSide));
    CHECK(s.volume_error == Approx(0.0).margin(1e-12));
    CHECK(s.box_min_error_m == shift);
    CHECK(s.box_max_error_m == shift);
    CHECK(s.whole.hausdorff_m == Approx(kShift).epsilon(1e-9));
    // Of six faces four slide along themselves: of these a strip of width s lies up to s beyond the other cube's
    // edge. The front face is s from the other's; the back face lies inside the other, s from its back and nearer
    // to the sides in a border of width s: 8² − 4 ∫₀ˢ (s − t)(8 − 2t) dt away from s · 8².
    const double strip = 4.0 * kSide * kShift * kShift / 2.0;
    const double border = 4.0 * (kSide * kShift * kShift / 2.0 - kShift * kShift * kShift / 3.0);
    const double mean = (2.0 * kSide * kSide * kShift + strip - border) / (6.0 * kSide * kSide);
    CHECK(s.whole.completeness_m == Approx(mean).epsilon(2e-3));
    CHECK(s.whole.accuracy_m == Approx(mean).epsilon(2e-3));
    CHECK(s.whole.chamfer_m == Approx(0.5 * (s.whole.completeness_m + s.whole.accuracy_m)));
    CHECK(s.whole.percentile95_m == Approx(kShift));
  }
}

TEST_CASE("concentric spheres lie the difference of their radii apart", "[score]") {
  const SurfaceMesh truth = sphere_mesh({1, 2, 3}, 4.0, 5), larger = sphere_mesh({1, 2, 3}, 5.0, 5);
  const SurfaceScore s = score_of(larger, truth);
  CHECK(s.iou == Approx(std::pow(0.8, 3)).epsilon(1e-3));
  CHECK(s.precision == Approx(s.iou));
  CHECK(s.recall == 1.0);
  CHECK(s.volume_error == Approx(std::pow(1.25, 3) - 1.0).epsilon(1e-3));
  CHECK(s.whole.completeness_m == Approx(1.0).epsilon(2e-3));
  CHECK(s.whole.accuracy_m == Approx(1.0).epsilon(2e-3));
  CHECK(s.whole.hausdorff_m == Approx(1.0).epsilon(4e-3));
  CHECK(s.whole.percentile95_m == Approx(1.0).epsilon(4e-3));
  CHECK(s.size_ratio == Approx(1.25));
  for (int axis = 0; axis < 3; ++axis) CHECK(s.box_max_error_m[axis] == Approx(-s.box_min_error_m[axis]));
}

TEST_CASE("pieces that overlap score as their union", "[score]") {
  const SurfaceMesh one = box_mesh({0, 0, 0}, {12, 4, 4});
  const SurfaceMesh two = joined(box_mesh({0, 0, 0}, {8, 4, 4}), box_mesh({4, 0, 0}, {12, 4, 4}));
  for (const SurfaceScore& s : {score_of(one, two), score_of(two, one), score_of(two, two)}) {
    CHECK(s.iou == Approx(1.0));
    // The walls inside the other box are buried: no distance is taken from them.
    CHECK(s.whole.hausdorff_m == Approx(0.0).margin(1e-9));
  }
}

TEST_CASE("a mesh that looks inward holds nothing and one with holes is told", "[score]") {
  const SurfaceMesh cube = cube_mesh({0, 0, 0}, 2.0);
  const SurfaceScore inward = score_of(inverted(cube), cube);
  CHECK(inward.iou == 0.0);
  CHECK(inward.volume_m3 == 0.0);
  CHECK(inward.volume_error == -1.0);
  CHECK(inward.whole.chamfer_m == Approx(0.0).margin(1e-12));
  SurfaceMesh open = cube;
  open.triangles.resize(6);  // two walls and the floor
  const SurfaceScore holed = score_of(open, cube);
  CHECK(holed.open_fraction == 1.0);
  CHECK(holed.truth_open_fraction == 0.0);
  CHECK(holed.whole.completeness_m > 0.1);
}

TEST_CASE("scores know no place and no scale", "[score]") {
  const SurfaceMesh truth = sphere_mesh({0.5, 0.25, -0.5}, 1.0, 3), extracted = box_mesh({-0.5, -0.5, -1}, {1, 1, 0.5});
  const SurfaceScore here = score_of(extracted, truth);
  struct Case {
    glm::dvec3 offset;
    double scale;
  };
  for (const Case& c : {Case{{5e5, 120, -4.2e6}, 1.0}, {{0, 0, 0}, 1e6}, {{0, 0, 0}, 1e-3}, {{-3e4, 10, 7e4}, 0.01}}) {
    const SurfaceScore s = score_of(moved(extracted, c.offset, c.scale), moved(truth, c.offset, c.scale));
    CHECK(s.iou == Approx(here.iou).epsilon(1e-4));
    CHECK(s.volume_m3 == Approx(here.volume_m3 * std::pow(c.scale, 3)).epsilon(1e-4));
    CHECK(s.whole.chamfer_m == Approx(here.whole.chamfer_m * c.scale).epsilon(1e-4));
    CHECK(s.whole.hausdorff_m == Approx(here.whole.hausdorff_m * c.scale).epsilon(1e-4));
    CHECK(s.size_ratio == Approx(here.size_ratio));
  }
}

TEST_CASE("scores do not depend on the number of threads", "[score]") {
  const SurfaceMesh truth = sphere_mesh({0, 0, 0}, 1.0, 3), extracted = sphere_mesh({0.1, 0, 0}, 0.9, 3);
  Acquisition view;
  view.slant_range_m = 1000.0;
  view.n_azimuth = view.n_range = 10;
  view.azimuth_spacing_m = view.range_spacing_m = 0.5;
  const auto with = [&](int n_threads) {
    const ThreadLimit limit(n_threads);
    return score(extracted, solid_truth(truth), {&view, 1}, quick());
  };
  const SurfaceScore one = with(1), three = with(3);
  CHECK(one.iou == three.iou);
  CHECK(one.visible_fraction == three.visible_fraction);
  CHECK(one.whole.chamfer_m == three.whole.chamfer_m);
  CHECK(one.visible.chamfer_m == three.visible.chamfer_m);
  CHECK(one.visible.hausdorff_m == three.visible.hausdorff_m);
}

TEST_CASE("truth in other units shows in the ratio of sizes", "[score]") {
  const SurfaceMesh cube = cube_mesh({0, 0, 0}, 2.0);
  const SurfaceScore s = score_of(cube, moved(cube, {}, 1000.0));
  CHECK(s.size_ratio == Approx(1e-3));
  CHECK(s.iou < 1e-6);
}

TEST_CASE("nothing can be compared with something", "[score]") {
  const SurfaceMesh cube = cube_mesh({0, 0, 0}, 2.0);
  const SurfaceScore none = score_of({}, cube), no_truth = score_of(cube, {}), neither = score_of({}, {});
  for (const SurfaceScore& s : {none, no_truth, neither}) {
    CHECK(s.iou == 0.0);
    CHECK(s.precision == 0.0);
    CHECK(s.recall == 0.0);
    CHECK(std::isnan(s.whole.chamfer_m));
    CHECK(std::isnan(s.whole.hausdorff_m));
    CHECK(std::isnan(s.box_min_error_m.x));
  }
  CHECK(none.size_ratio == 0.0);
  CHECK(none.truth_volume_m3 == Approx(8.0));
  CHECK(none.volume_error == -1.0);
  CHECK(std::isnan(no_truth.size_ratio));
  CHECK(std::isnan(no_truth.volume_error));
  CHECK(neither.column_spacing_m == 0.0);
  // All in one point.
  const SurfaceMesh point{{{1, 1, 1}}, {{0, 0, 0}}};
  CHECK(score_of(point, cube).iou == 0.0);
  CHECK(std::isnan(score_of(point, cube).whole.accuracy_m));
  CHECK(std::isnan(score_of(point, point).size_ratio));
}

TEST_CASE("nonsense is refused", "[score]") {
  const SurfaceMesh cube = cube_mesh({0, 0, 0}, 2.0);
  SurfaceMesh beyond = cube, not_finite = cube;
  beyond.triangles[3].y = 8;
  not_finite.vertices_m[5].z = std::numeric_limits<double>::quiet_NaN();
  for (const SurfaceMesh& bad : {beyond, not_finite}) {
    CHECK_THROWS_AS(score_of(bad, cube), InputError);
    CHECK_THROWS_AS(score_of(cube, bad), InputError);
  }
  CHECK_THROWS_AS(score(cube, {cube, cube, 13}, {}), InputError);
  CHECK_THROWS_AS(score(cube, {beyond, cube, 12}, {}), InputError);
  CHECK_THROWS_AS(score_of(cube, cube, -1.0), UsageError);
  ScoreOptions none;
  none.n_samples = 0;
  CHECK_THROWS_AS(score(cube, solid_truth(cube), {}, none), UsageError);
  CHECK_THROWS_AS(score(cube, solid_truth(cube), std::vector<Acquisition>(1)), GeometryError);
}

TEST_CASE("a score can be watched and stopped", "[score]") {
  const SurfaceMesh cube = cube_mesh({0, 0, 0}, 2.0);
  const std::atomic<bool> stop{true};
  ScoreOptions options = quick();
  options.monitor.stop = &stop;
  CHECK_THROWS_AS(score(cube, solid_truth(cube), {}, options), Interrupted);
  options.monitor.stop = nullptr;
  std::uint64_t n_reports = 0;
  options.monitor.progress = [&](std::string_view, std::uint64_t done, std::uint64_t total) {
    ++n_reports;
    CHECK(done <= total);
  };
  score(cube, solid_truth(cube), {}, options);
  CHECK(n_reports > 0);
}

TEST_CASE("the solid may be another mesh than the surface", "[score]") {
  // A sheet that stands for a hull beyond it.
  const SurfaceMesh sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {{0, 1, 2}}};
  const SurfaceMesh cube = cube_mesh({-4, 0, -4}, 8.0);
  const SurfaceScore s = score(cube, {cube, sheet, 0}, {}, quick());
  CHECK(s.iou == 1.0);
  CHECK(s.truth_volume_m3 == Approx(512.0));
}

TEST_CASE("a scene's closed pieces are solids and all of it is surface", "[score]") {
  Scene scene;
  const SurfaceMesh cube = cube_mesh({0, 0, 0}, 2.0);
  scene.mesh.vertices_m = cube.vertices_m;
  scene.mesh.vertices_m.insert(scene.mesh.vertices_m.end(), {{5, 0, 5}, {6, 0, 5}, {6, 1, 5}});
  scene.mesh.triangles = {{8, 9, 10}};  // an open piece comes first
  scene.mesh.triangles.insert(scene.mesh.triangles.end(), cube.triangles.begin(), cube.triangles.end());
  scene.mesh.piece.assign(13, 1);
  scene.mesh.piece[0] = 0;
  scene.pieces = {{false, 0}, {true, 0}};
  const TruthSurface truth = truth_of(scene);
  CHECK(truth.solid.triangles == cube.triangles);
  CHECK(truth.n_closed == 12);
  CHECK(truth.all.triangles.size() == 13);
  CHECK(truth.all.triangles.back() == glm::uvec3(8, 9, 10));
  const SurfaceScore s = score(cube, truth, {}, quick(0.0625));
  CHECK(s.iou == Approx(1.0));
  CHECK(s.whole.completeness_m > 0.01);
  CHECK(s.whole.accuracy_m == Approx(0.0).margin(1e-12));
}
