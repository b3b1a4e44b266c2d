// SPDX-License-Identifier: Apache-2.0
#include "catch.h"
#include "sarnerf/core/error.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

TEST_CASE("the default frame holds scene, layover and shadow in every view", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {12.0, 9.0, 5.0}, 0.0, {100.0, 7.0, -30.0});
  const glm::dvec3 aim = default_aim_m(scene);
  CHECK(aim.x == Approx(100.0));
  CHECK(aim.y == Approx(7.0));
  CHECK(aim.z == Approx(-30.0));
  std::vector<Acquisition> views;
  for (double azimuth = 0.0; azimuth < 360.0; azimuth += 15.0) {
    for (const double pitch : {20.0, 45.0, 70.0}) {
      views.push_back(view_of(pitch, 1e4, 1, 1, 0.3, azimuth));
      views.back().aim_m = aim;
    }
  }
  const Framing framing = frame_scene(scene, views);
  CHECK_FALSE(framing.explanation.empty());
  scene.ground = Ground{0, 7.0};
  const SurfaceEngine engine(scene);
  for (Acquisition view : views) {
    view.n_azimuth = framing.n_azimuth;
    view.n_range = framing.n_range;
    CHECK(outside_swath_warning(scene, view).empty());
    // Shadow is where the ground is dark; none of it may touch the border.
    const Image<float> image = engine.render(engine.plan(view, {.n_slices = 1})).beta0;
    for (int i = 0; i < view.n_azimuth; ++i) {
      CHECK(image(i, 0) > 0.0f);
      CHECK(image(i, view.n_range - 1) > 0.0f);
    }
  }
}

TEST_CASE("a scene outside the swath is called that", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {12.0, 9.0, 5.0});
  Acquisition view = view_of(45.0);
  view.aim_m = {500.0, 0.0, 0.0};
  CHECK(outside_swath_warning(scene, view).find("outside the swath") != std::string::npos);
  const SurfaceEngine engine(scene);
  const RenderedView rendered = engine.render(engine.plan(view, {}));
  REQUIRE(rendered.warnings.size() == 1);
  CHECK(rendered.warnings[0].find("blank") != std::string::npos);
  CHECK(rendered.warnings[0].find("--aim") != std::string::npos);
}

TEST_CASE("the frame of a scene close to the radar ends at range zero", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {4.0, 1.0, 2.0});
  // The slant range is less than what margins and shadow take.
  const std::vector<Acquisition> views{view_of(45.0, 1.8)};
  const Framing framing = frame_scene(scene, views);
  Acquisition view = views.front();
  view.n_azimuth = framing.n_azimuth;
  view.n_range = framing.n_range;
  CHECK_NOTHROW(validate(view));
  CHECK(view.range_m(-0.5) < view.range_spacing_m);
  CHECK(framing.explanation.find("above zero") != std::string::npos);
  const SurfaceEngine engine(scene);
  CHECK(sum(engine.render(engine.plan(view, {})).beta0) > 0.0);
}

TEST_CASE("a wall that passes the radar's height is nearest between its corners, and the frame holds it", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {10.0, 200.0, 10.0});
  Acquisition view = view_of(80.0, 100.0);
  const Framing framing = frame_scene(scene, {&view, 1});
  view.n_azimuth = framing.n_azimuth;
  view.n_range = framing.n_range;
  CHECK(outside_swath_warning(scene, view).empty());
  const SurfaceEngine engine(scene);
  const double held = sum(engine.render(engine.plan(view, {})).beta0);
  view.n_range *= 2;
  CHECK(held == Approx(sum(engine.render(engine.plan(view, {})).beta0)).epsilon(1e-3));
}

TEST_CASE("beneath the radar the nearest point of a roof is no corner", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {100.0, 10.0, 100.0});
  const std::vector<Acquisition> views{view_of(5.0, 200.0)};
  const std::string text = frame_scene(scene, views).explanation;
  double near_m = 0.0;
  REQUIRE(std::sscanf(text.c_str() + text.find("(from") + 5, "%lf", &near_m) == 1);
  // The radar stands over the roof, at 190 m: the aim point is 200 m / cos 5 deg away.
  CHECK(near_m == Approx(200.0 / std::cos(rad_from_deg(5.0)) - 190.0).epsilon(1e-3));
}

TEST_CASE("the explanation says where layover and shadow end", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {2.0, 3.0, 4.0});  // x, y, z
  for (const double pitch_deg : {1.0, 30.0, 60.0, 85.0}) {
    const double theta = rad_from_deg(pitch_deg);
    const std::vector<Acquisition> views{view_of(pitch_deg, 1e7)};
    const std::string text = frame_scene(scene, views).explanation;
    double near_m = 0.0, shadow_m = 0.0;
    INFO(text);
    REQUIRE(std::sscanf(text.c_str() + text.find("(from") + 5, "%lf", &near_m) == 1);
    REQUIRE(std::sscanf(text.c_str() + text.find("(to") + 3, "%lf", &shadow_m) == 1);
    CHECK(near_m == Approx(3.0 * std::cos(theta) + 2.0 * std::sin(theta)).epsilon(2e-3));
    CHECK(shadow_m == Approx((2.0 + 3.0 * std::tan(theta)) * std::sin(theta)).epsilon(2e-3));
  }
}

TEST_CASE("a lower reference plane has a longer shadow, for which the frame has room", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {2.0, 3.0, 4.0});
  const std::vector<Acquisition> views{view_of(45.0, 1e7)};
  const Framing by_default = frame_scene(scene, views), same = frame_scene(scene, views, 0.0), lower = frame_scene(scene, views, -10.0);
  CHECK(same.n_range == by_default.n_range);
  // A ray that ends 10 m lower is 10 m / cos θ longer; the image is as wide on the other side of the aim point.
  const double longer_m = 2.0 * 10.0 / std::cos(views[0].incidence_rad);
  CHECK(lower.n_range - same.n_range == Approx(longer_m / views[0].range_spacing_m).margin(2.0));
}

TEST_CASE("absurd sizes are refused with advice", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {12e6, 9e6, 5e6});
  const std::vector<Acquisition> views{view_of(45.0, 1e9)};
  CHECK_THROWS_AS(frame_scene(scene, views), UsageError);
}

TEST_CASE("impossible views are refused", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {12.0, 900.0, 5.0});
  const SurfaceEngine engine(scene);
  CHECK_THROWS_AS(engine.plan(view_of(45.0, 100.0), {}), GeometryError);
  CHECK_THROWS_AS(engine.plan(view_of(0.0), {}), GeometryError);
  CHECK_THROWS_AS(engine.plan(view_of(90.0), {}), GeometryError);
  CHECK_THROWS_AS(SurfaceEngine(empty_scene(matte())), GeometryError);
}

TEST_CASE("the plan says what is left out, and keeps few rays", "[framing]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {12.0, 6.0, 8.0});
  const SurfaceEngine engine(scene);
  const ViewPlan plan = engine.plan(view_of(45.0), {});
  CHECK(plan.n_kept_rays > 0);
  CHECK(plan.n_kept_rays < plan.n_grid_rays / 2);
  CHECK(plan.left_out.size() >= 3);
  CHECK(plan.chosen.size() == 2);
}
