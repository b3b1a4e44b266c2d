// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <vector>

#include "catch.h"
#include "sarnerf/bake/score.h"
#include "sarnerf/core/units.h"
#include "solid_meshes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A view at 45° from far away, whose swath holds 40 m about the aim.
Acquisition view_from(double azimuth_deg, const glm::dvec3& aim_m = glm::dvec3(0.0), double scale = 1.0) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(azimuth_deg);
  a.incidence_rad = rad_from_deg(45.0);
  a.slant_range_m = 1e5 * scale;
  a.aim_m = aim_m;
  a.n_azimuth = a.n_range = 100;
  a.azimuth_spacing_m = a.range_spacing_m = 0.4 * scale;
  return a;
}

const std::vector<Acquisition> kFourSides = {view_from(0), view_from(90), view_from(180), view_from(270)};

SurfaceScore against_itself(const SurfaceMesh& mesh, const std::vector<Acquisition>& views) {
  ScoreOptions options;
  options.n_samples = 20'000;
  options.column_spacing_m = 0.25;
  return score(mesh, solid_truth(mesh), views, options);
}

// Faces of 8 × 4 (front, back), 6 × 4 (sides) and 8 × 6 (top, bottom).
const SurfaceMesh kBox = box_mesh({-4, 0, -3}, {4, 4, 3});
constexpr double kFront = 32.0, kSide = 24.0, kTop = 48.0, kArea = 2.0 * (kFront + kSide + kTop);

}  // namespace

TEST_CASE("from four sides all of a box is visible but its bottom", "[visible]") {
  const SurfaceScore s = against_itself(kBox, kFourSides);
  CHECK(s.visible_fraction == Approx((kArea - kTop) / kArea).margin(1e-3));
  CHECK(s.extracted_visible_fraction == s.visible_fraction);
  CHECK(s.visible.chamfer_m == Approx(0.0).margin(1e-12));
}

TEST_CASE("from one side a box shows its front and its top", "[visible]") {
  CHECK(against_itself(kBox, {view_from(0)}).visible_fraction == Approx((kFront + kTop) / kArea).margin(1e-3));
  CHECK(against_itself(kBox, {view_from(90)}).visible_fraction == Approx((kSide + kTop) / kArea).margin(1e-3));
  CHECK(against_itself(kBox, {view_from(45)}).visible_fraction == Approx((kFront + kSide + kTop) / kArea).margin(1e-3));
  Acquisition left = view_from(0);
  left.look = Look::left;
  CHECK(against_itself(kBox, {left}).visible_fraction == Approx((kFront + kTop) / kArea).margin(1e-3));
}

TEST_CASE("the wall that a view sees is the one that faces it", "[visible]") {
  // The wall towards +Z stands 1 m too far out: only views from there can tell.
  const SurfaceMesh longer = box_mesh({-4, 0, -3}, {4, 4, 4});
  ScoreOptions options;
  options.n_samples = 20'000;
  const SurfaceScore front = score(longer, solid_truth(kBox), std::vector{view_from(0)}, options);
  const SurfaceScore back = score(longer, solid_truth(kBox), std::vector{view_from(180)}, options);
  // From the back the wall is invisible; the longer roof is seen, and lies up to 1 m beyond the true one.
  CHECK(front.visible.completeness_m > 0.25);
  CHECK(back.visible.completeness_m < 1e-9);
  CHECK(front.visible.hausdorff_m == Approx(1.0));
  CHECK(front.visible.accuracy_m == Approx((kFront * 1.0 + 8.0 * 0.5) / (kFront + 56.0)).epsilon(0.01));
  CHECK(back.visible.accuracy_m == Approx(8.0 * 0.5 / (kFront + 56.0)).epsilon(0.02));
}

TEST_CASE("distances are given apart for what is laid over in every view", "[visible]") {
  // At 45 degrees the wall, 4 m high, and the first 4 m of the roof share their bins. In the bin of their common edge, 0 to 0.4 m from
  // it in slant range, there is no gap of a pixel between them: nor in the next one, if the edge lies at its border.
  const double edge = 8.0 * 0.6 * std::numbers::sqrt2;
  const SurfaceScore same = against_itself(kBox, {view_from(0)});
  CHECK(same.laid_over_fraction == Approx((2.0 * kFront - 2.0 * edge) / (kFront + kTop)).margin(0.05));
  // From four sides some view sees each point of the roof alone, and none the walls.
  const double edges = edge * 28.0 / 8.0;
  CHECK(against_itself(kBox, kFourSides).laid_over_fraction ==
        Approx((2.0 * (kFront + kSide) - edges) / (2.0 * (kFront + kSide) + kTop)).margin(0.05));
  // The wall is 0.2 m from the extracted one, or a little less near its borders; the roof is the same.
  ScoreOptions options;
  options.n_samples = 20'000;
  const SurfaceScore s = score(box_mesh({-4, 0, -3}, {4, 4, 3.2}), solid_truth(kBox), std::vector{view_from(0)}, options);
  CHECK(s.completeness_laid_over_m == Approx(0.5 * 0.2).epsilon(0.1));
  CHECK(s.completeness_alone_m < 0.5 * s.completeness_laid_over_m);
  CHECK(std::isnan(score(kBox, solid_truth(kBox), {}, options).laid_over_fraction));
}

TEST_CASE("a swath that misses the box sees nothing and one that holds half of it half", "[visible]") {
  Acquisition beside = view_from(0);
  beside.aim_m = {100, 0, 0};
  CHECK(against_itself(kBox, {beside}).visible_fraction == 0.0);
  Acquisition beyond = view_from(0);
  beyond.aim_m = {0, 0, -200};
  CHECK(against_itself(kBox, {beyond}).visible_fraction == 0.0);
  // Rows up to the middle of the box alone.
  Acquisition half = view_from(0);
  half.aim_m = {20, 0, 0};
  CHECK(against_itself(kBox, {half}).visible_fraction == Approx(0.5 * (kFront + kTop) / kArea).margin(2e-3));
}

TEST_CASE("a box behind a big one is hidden", "[visible]") {
  // The shadow of 20 m of wall at 45° reaches 20 m behind it.
  const SurfaceMesh big = box_mesh({-15, 0, 0}, {15, 20, 2}), small = box_mesh({-2, 0, -8}, {2, 4, -4});
  const double big_area = 2.0 * (30 * 20 + 30 * 2 + 20 * 2), small_area = 6.0 * 16;
  Acquisition wide = view_from(0);
  wide.n_range = 400;
  Acquisition from_behind = wide;
  from_behind.azimuth_rad = rad_from_deg(180.0);
  const double in_front = against_itself(joined(big, small), {wide}).visible_fraction;
  CHECK(in_front == Approx((600.0 + 60.0) / (big_area + small_area)).margin(1e-3));
  // From behind: the big one's wall and roof, the small one's. At 45° a box of 4 m, 4 m before the wall, throws no
  // shadow on it.
  const double behind = against_itself(joined(big, small), {from_behind}).visible_fraction;
  CHECK(behind == Approx((660.0 + 32.0) / (big_area + small_area)).margin(1e-3));
}

TEST_CASE("thin shells are seen from both sides", "[visible]") {
  // A standing sheet, looking to +Z.
  const SurfaceMesh sheet{{{-4, 0, 0}, {4, 0, 0}, {4, 4, 0}, {-4, 4, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  ScoreOptions options;
  options.n_samples = 5000;
  for (const double azimuth_deg : {0.0, 180.0}) {
    const std::vector views{view_from(azimuth_deg)};
    const SurfaceScore s = score(sheet, {{}, sheet, 0}, views, options);
    CHECK(s.visible_fraction == 1.0);
    CHECK(s.extracted_visible_fraction == (azimuth_deg == 0.0 ? 1.0 : 0.0));  // an extracted surface has an outside
    CHECK(s.truth_volume_m3 == 0.0);
    CHECK(s.iou == 0.0);
  }
}

TEST_CASE("buried walls are neither surface nor visible", "[visible]") {
  // Two boxes that touch: the common wall is no surface.
  const SurfaceMesh two = joined(box_mesh({-4, 0, -3}, {0, 4, 3}), box_mesh({0, 0, -3}, {4, 4, 3}));
  CHECK(against_itself(two, kFourSides).visible_fraction == Approx((kArea - kTop) / kArea).margin(2e-3));
}

TEST_CASE("what is visible knows no place and no scale", "[visible]") {
  const SurfaceMesh scene = joined(kBox, box_mesh({5, 0, -2}, {7, 2, 2}));
  ScoreOptions options;
  options.n_samples = 20'000;
  const auto fraction = [&](const glm::dvec3& offset, double scale) {
    const SurfaceMesh there = moved(scene, offset, scale);
    const std::vector views{view_from(30, offset, scale), view_from(200, offset, scale)};
    return score(there, solid_truth(there), views, options).visible_fraction;
  };
  const double here = fraction(glm::dvec3(0.0), 1.0);
  CHECK(here > 0.4);
  CHECK(fraction({5e5, 120, -4.2e6}, 1.0) == Approx(here).margin(2e-4));
  CHECK(fraction(glm::dvec3(0.0), 1e6) == Approx(here).margin(2e-4));
  CHECK(fraction(glm::dvec3(0.0), 1e-3) == Approx(here).margin(2e-4));
}

TEST_CASE("normals are compared where views see the truth", "[visible]") {
  // A wedge against a slab: the top is inclined by 20 degrees, and a steep view sees hardly anything else.
  const auto wedge = [](double rise) {
    SurfaceMesh mesh = box_mesh({-4, 0, -4}, {4, 2, 4});
    for (glm::dvec3& v : mesh.vertices_m)
      if (v.y > 1.0) v.y += rise * (v.x + 4.0);
    return mesh;
  };
  constexpr double kAngle = 20.0 * std::numbers::pi / 180.0;
  Acquisition above = view_from(0);
  above.incidence_rad = 0.1;
  ScoreOptions options;
  options.n_samples = 10'000;
  const auto error = [&](const SurfaceMesh& mesh) {
    return score(mesh, solid_truth(wedge(0.0)), std::vector<Acquisition>{above}, options).normal_error_rad;
  };
  CHECK(error(wedge(0.0)) == Approx(0.0).margin(1e-6));
  CHECK(error(wedge(std::tan(kAngle))) == Approx(kAngle).epsilon(0.01));
  CHECK(std::isnan(score(wedge(0.0), solid_truth(wedge(0.0)), {}, options).normal_error_rad));
}

TEST_CASE("space under a slab that no ray reaches is left out of the observable overlap", "[visible]") {
  // A slab of 4 x 1 x 4 m on a pole of 1 x 2 x 1 m, and a solid that also fills the space below the slab.
  const SurfaceMesh truth = joined(box_mesh({-2, 2, -2}, {2, 3, 2}), box_mesh({-0.5, 0, -0.5}, {0.5, 2.01, 0.5}));
  const SurfaceMesh filled = box_mesh({-2, 0, -2}, {2, 3, 2});
  constexpr double kTruth_m3 = 16.0 + 2.0, kFilled_m3 = 48.0;
  const auto with = [&](double incidence_deg) {
    Acquisition a = view_from(0);
    a.incidence_rad = rad_from_deg(incidence_deg);
    ScoreOptions options;
    options.n_samples = 20'000;
    options.column_spacing_m = 1.0 / 128.0;
    return score(filled, solid_truth(truth), std::vector<Acquisition>{a}, options);
  };
  // From above no ray comes under the slab.
  const SurfaceScore above = with(0.5);
  CHECK(above.iou == Approx(kTruth_m3 / kFilled_m3).epsilon(0.01));
  CHECK(above.observable_iou == Approx(1.0).epsilon(0.02));
  CHECK(above.hull_iou == Approx(kTruth_m3 / kFilled_m3).epsilon(0.02));
  // The slab without what the pole covers, and the pole with its foot.
  CHECK(above.symmetric_difference_m == Approx((kFilled_m3 - kTruth_m3) / (48.0 - 1.0 + 8.0 + 1.0)).epsilon(0.01));
  // From the side only the shadow of the pole is hidden: 1 x 2 x 1.5 m.
  const SurfaceScore side = with(89.5);
  CHECK(side.observable_iou == Approx(kTruth_m3 / (kFilled_m3 - 3.0)).epsilon(0.02));
  CHECK(side.hull_iou == Approx(kTruth_m3 / (kTruth_m3 + 3.0)).epsilon(0.02));
}
