// SPDX-License-Identifier: Apache-2.0
// The edges of what a view can be: nadir, horizon, the radar among the scene, images of one pixel and of
// many, pixels far from square, scenes far larger than pixels.
#include "catch.h"
#include "extreme_scenes.h"
#include "matrix.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// What a function's error says; empty if it throws none.
template <class F>
std::string refusal(F&& f) {
  try {
    f();
  } catch (const GeometryError& error) {
    return error.what();
  }
  return {};
}

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a level plane across the nadir is seen on both sides, at the same ranges", "[geometry]") {
  for (const double pitch : {0.5, 3.0, 10.0}) {
    Acquisition a = extreme_view(1000.0, pitch, 1.0, 3, 96);
    a.azimuth_rad = 0.7;
    INFO(text_of(a));
    const double nadir_m = -1000.0 * std::sin(a.incidence_rad), height_m = 3.0, reach_m = 400.0;
    const double far_side = nadir_m - reach_m, near_side = nadir_m + reach_m;
    const Scene scene = sheet_facing(a, {-20.0, height_m, -far_side}, {40.0, 0.0, 0.0}, {0.0, 0.0, far_side - near_side});
    const Image<float> image = render_surface(scene, a);
    CHECK(sound(image));
    // Both sides alike, as far as the image reaches.
    const KnownPlane one_side = KnownPlane::level(a, height_m, nadir_m, near_side);
    double worst = 0.0;
    int n_seen = 0;
    for (int j = 0; j < a.n_range; ++j) {
      const double expected = 2.0 * one_side.beta0(j);
      worst = worse(worst, std::abs(double(image(1, j)) - expected) / std::max(1.0, expected));
      n_seen += image(1, j) > 0.0f;
    }
    CHECK(n_seen > 20);
    record(Case::nadir, worst);
    // At the nadir itself range hardly depends on the angle: there a run's 0.004 of a bin is much of its bin.
    CHECK(worst < 0.02);
  }
}

TEST_CASE("the ground begins at nadir and is seen on the radar's side only", "[geometry]") {
  Acquisition a = extreme_view(1000.0, 3.0, 1.0, 3, 96);
  Scene scene = empty_scene(matte());
  scene.ground = Ground{0, 0.0};
  // A mesh on the other side of nadir, far from what is looked at, opens the fan there.
  add_box(scene, {1.0, 1.0, 1.0}, 0.0, {500.0, 0.0, 1000.0 * std::sin(a.incidence_rad) + 300.0});
  const Image<float> image = render_surface(scene, a);
  CHECK(sound(image));
  const KnownPlane plane = KnownPlane::level(a, 0.0, -1000.0 * std::sin(a.incidence_rad), 1e4);
  double worst = 0.0;
  for (int j = 0; j < a.n_range; ++j) {
    const double expected = plane.beta0(j);
    worst = worse(worst, std::abs(double(image(1, j)) - expected) / std::max(1.0, expected));
  }
  record(Case::nadir, worst);
  CHECK(worst < 0.005);
}

TEST_CASE("a wall as high as twice the radar, before the horizon", "[geometry]") {
  Acquisition a = extreme_view(slant_range_from_altitude_m(100.0, rad_from_deg(89.5)), 89.5, 0.02, 3, 64);
  INFO(text_of(a));
  const double altitude_m = a.altitude_m();
  Scene scene = wall_scene(a, {2.0 * altitude_m, 0.0});
  SECTION("alone") {
    const Image<float> image = render_surface(scene, a);
    CHECK(sound(image));
    const KnownPlane lower = KnownPlane::wall(a, 0.0, altitude_m);
    double worst = 0.0;
    for (int j = 0; j < a.n_range; ++j) {
      const double expected = 2.0 * lower.beta0(j);
      worst = worse(worst, std::abs(double(image(1, j)) - expected) / std::max(1.0, expected));
    }
    record(Case::horizon, worst);
    CHECK(worst < 0.005);
  }
  SECTION("on the ground, which it hides up to the horizon") {
    scene.ground = Ground{0, 0.0};
    const Image<float> image = render_surface(scene, a);
    CHECK(sound(image));
    double behind = 0.0;
    for (int j = a.n_range / 2 + 1; j < a.n_range; ++j) behind = std::max(behind, double(image(1, j)));
    record(Case::horizon, behind);
    CHECK(behind == 0.0);
  }
}

TEST_CASE("layers at the nadir, at the horizon and from geostationary range", "[geometry]") {
  struct Edge {
    Acquisition view;
    Scene scene;
    double lowest_m, highest_m;
  };
  std::vector<Edge> edges;
  const Acquisition nadir = extreme_view(1000.0, 0.5, 1.0, 3, 96);
  edges.push_back({nadir, sheet_facing(nadir, {-20.0, 3.0, 400.0}, {40.0, 0.0, 0.0}, {0.0, 0.0, -800.0}), 0.0, 3.0});
  const Acquisition horizon = extreme_view(slant_range_from_altitude_m(100.0, rad_from_deg(89.5)), 89.5, 0.02, 3, 64);
  edges.push_back({horizon, wall_scene(horizon, {200.0, 0.0}), 0.0, 200.0});
  const Acquisition orbit = extreme_view(3.6e7, 89.5, 0.3, 3, 48);
  edges.push_back({orbit, roof_scene(orbit, *roof_of_bins(orbit, 24)), 0.0, 0.9});
  for (Edge& edge : edges) {
    INFO(text_of(edge.view));
    edge.scene.ground = Ground{0, 0.0};
    const SurfaceEngine engine(edge.scene);
    ViewPlan plan = engine.plan(edge.view, {});
    request_layers(plan, {all_layers(), 0.0});
    const RenderedView view = engine.render(plan);
    CHECK(sound(view.beta0));
    double largest = 0.0;
    for (int i = 0; i < edge.view.n_azimuth; ++i) {
      for (int j = 0; j < edge.view.n_range; ++j) {
        const double power = view.beta0(i, j);
        double parts = 0.0;
        for (const Image<float>& part : view.layers.beta0) parts += part(i, j);
        largest = worse(largest, std::abs(parts - power) / std::max(power, 1e-3));
        if (!(power > 0.0)) continue;
        const double incidence = view.layers.incidence_deg(i, j), elevation = view.layers.elevation_m(i, j);
        CHECK((incidence >= 0.0 && incidence <= 90.0));
        CHECK((elevation >= edge.lowest_m - 0.01 && elevation <= edge.highest_m + 0.01));
      }
    }
    record(Case::layers, largest);
    CHECK(largest < 1e-5);
  }
}

TEST_CASE("a scene around the radar, or behind it, is refused", "[geometry]") {
  const Acquisition a = extreme_view(100.0, 40.0, 0.3, 8, 64);
  Scene around = empty_scene(matte()), behind = around;
  add_box(around, {400.0, 300.0, 400.0});
  add_box(behind, {10.0, 10.0, 400.0});
  for (const Scene* scene : {&around, &behind}) {
    const SurfaceEngine surface(*scene);
    CHECK(says(refusal([&] { (void)surface.plan(a, {}); }), "behind the radar"));
    const VoxelEngine voxels(*scene, voxels_of(*scene, 4.0));
    CHECK(says(refusal([&] { (void)voxels.plan(a, {}); }), "behind the radar"));
  }
  Scene ground = empty_scene(matte());
  ground.ground = Ground{0, 80.0};
  const SurfaceEngine engine(ground);
  CHECK(says(refusal([&] { (void)engine.plan(a, {}); }), "below the ground"));
}

TEST_CASE("images of one pixel, of one row, of one bin, and of 4096 rows", "[geometry]") {
  for (const auto& [n_azimuth, n_range] : {std::pair{1, 1}, {1, 64}, {64, 1}, {4096, 64}}) {
    Acquisition a = extreme_view(1e4, 40.0, 0.3, n_azimuth, n_range);
    a.azimuth_rad = 2.0;
    INFO(n_azimuth << " x " << n_range);
    const auto extent = roof_of_bins(a, 80);
    REQUIRE(extent);
    const Scene scene = roof_scene(a, *extent);
    const Image<float> image = render_surface(scene, a);
    CHECK(sound(image));
    const KnownPlane plane = KnownPlane::level(a, extent->height_m, -extent->half_m, extent->half_m);
    double worst = 0.0;
    for (int i = 0; i < n_azimuth; i += std::max(1, n_azimuth / 97)) {
      for (int j = 0; j < n_range; ++j) {
        worst = worse(worst, std::abs(double(image(i, j)) / plane.beta0(j) - 1.0));
      }
    }
    record(Case::image_sizes, worst);
    CHECK(worst < 0.005);
    if (n_azimuth * n_range > 64) continue;
    const Image<float> voxels = render_voxels(scene, a, 0.15);
    CHECK(sound(voxels));
    worst = 0.0;
    for (int j = 0; j < n_range; ++j) {
      worst = worse(worst, std::abs(double(voxels(n_azimuth / 2, j)) / plane.beta0(j) - 1.0));
    }
    record(Case::image_sizes_voxels, worst);
    CHECK(worst < 0.02);
  }
}

TEST_CASE("pixels far from square", "[geometry]") {
  for (const auto& [azimuth_m, range_m] : {std::pair{1e-3, 1.0}, {1e-3, 10.0}, {0.1, 3.0}, {3.0, 0.1}, {10.0, 0.01}, {100.0, 0.02}}) {
    Acquisition a = extreme_view(7e5, 40.0, range_m, 3, 48);
    a.azimuth_spacing_m = azimuth_m;
    a.azimuth_rad = 1.0;
    INFO(text_of(a));
    const auto roof = roof_of_bins(a, 24), wall = wall_of_bins(a, 24);
    REQUIRE((roof && wall));
    const double error =
        std::max(worst_error(render_surface(roof_scene(a, *roof), a),
                             KnownPlane::level(a, roof->height_m, -roof->half_m, roof->half_m)),
                 worst_error(render_surface(wall_scene(a, *wall), a), KnownPlane::wall(a, 0.0, wall->height_m)));
    record(Case::anisotropic, error);
    CHECK(error < 0.02);
  }
}

TEST_CASE("scenes that reach far beyond the image, and those refused for it", "[geometry]") {
  Acquisition a = extreme_view(7e5, 40.0, 0.3, 9, 48);
  a.azimuth_rad = 1.0;
  const auto extent = wall_of_bins(a, 24);
  REQUIRE(extent);
  const KnownPlane plane = KnownPlane::wall(a, 0.0, extent->height_m);
  for (const double reach_pixels : {1e3, 1e4, 1e5, 2.5e5, 2.7e5}) {
    INFO("reaching " << reach_pixels << " pixels");
    // Something small at the other end of the box, whose centre is the origin of single precision.
    Scene scene = wall_scene(a, *extent);
    const double reach_m = reach_pixels * a.range_spacing_m;
    add_sheet(scene, glm::dvec3(-1.0, 0.0, -1.0) * std::sqrt(2.0) * reach_m, {0.1, 0.0, 0.0}, {0.0, 0.0, 0.1});
    const SurfaceEngine engine(scene);
    if (reach_pixels > 262144.0) {
      CHECK(says(refusal([&] { (void)engine.plan(a, {}); }), "262144 are the limit"));
      continue;
    }
    const double error = worst_error(engine.render(engine.plan(a, {})).beta0, plane);
    record(Case::reach, error);
    CHECK(error < 0.02);
  }
}
