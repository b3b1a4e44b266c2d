// SPDX-License-Identifier: Apache-2.0
#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Sum over bins of β⁰ Δr, in the row through the middle: what the rays of one row collect.
double collected(const Image<float>& image, const Acquisition& view) {
  double total = 0.0;
  for (int j = 0; j < view.n_range; ++j) total += image(view.n_azimuth / 2, j) * view.range_spacing_m;
  return total;
}

}  // namespace

TEST_CASE("a thin box scatters P times its cross-section", "[media]") {
  Scene scene = empty_scene(fog(0.0, 0.01));
  add_box(scene, {20.0, 4.0, 6.0});
  for (const double pitch : {20.0, 45.0, 70.0}) {
    const Acquisition view = view_of(pitch, 1e4, 8, 128);
    // ∫∫ P dr (r dδ): the area of the row's cut through the box.
    CHECK(collected(render(scene, view), view) == Approx(0.01 * 4.0 * 6.0).epsilon(0.002));
  }
}

TEST_CASE("a slab seen from straight ahead follows its closed form at every depth", "[media]") {
  // A slab whose faces are perpendicular to the rays: all of them cross length L.
  for (const double depth : {1e-3, 0.1, 1.0, 5.0, 40.0, 1e4}) {
    const double length = 3.0, two_way = depth / length, scattering = 0.4 * two_way;
    INFO("depth " << depth);
    Scene scene = empty_scene(fog(0.5 * two_way, scattering));
    const double pitch = rad_from_deg(45.0);
    const glm::dvec3 k(0.0, -std::cos(pitch), -std::sin(pitch)), v(0.0, std::sin(pitch), -std::cos(pitch)),
        h(-1.0, 0.0, 0.0);
    std::vector<glm::dvec3> c;
    for (int n = 0; n < 8; ++n) {
      c.push_back((n & 1 ? 10.0 : -10.0) * h + (n & 2 ? 4.0 : -4.0) * v + (n & 4 ? length : 0.0) * k);
    }
    add_piece(scene, c,
              {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
               {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}},
              true);
    const Acquisition view = view_of(45.0, 1e5, 8, 64);
    const double expected = 8.0 * scattering * -std::expm1(-depth) / two_way;
    // The slab's outline falls between rays: one ray in a thousand.
    CHECK(collected(render(scene, view, {.n_elevation = 2000, .n_slices = 8}), view) == Approx(expected).epsilon(0.001));
  }
}

TEST_CASE("a very dense medium looks like an opaque one of gamma = P / two-way extinction", "[media]") {
  Scene dense = empty_scene(fog(500.0, 300.0)), opaque = empty_scene(matte(0.0, 0.3));
  add_box(dense, {12.0, 6.0, 8.0}, 0.5);
  add_box(opaque, {12.0, 6.0, 8.0}, 0.5);
  const Acquisition view = view_of(40.0, 1e4, 96, 96);
  CHECK(relative_l2(render(dense, view, {.n_slices = 8}), render(opaque, view, {.n_slices = 8})) < 0.04);
}

TEST_CASE("a canopy attenuates the wall behind it as exp(-two-way depth)", "[media]") {
  const Acquisition view = view_of(45.0, 1e5, 8, 128);
  const auto wall = [](Scene& scene) {
    scene.materials.push_back(matte());
    add_piece(scene, {{-20, 0, 0}, {20, 0, 0}, {20, 5, 0}, {-20, 5, 0}}, {{0, 1, 2}, {0, 2, 3}}, false, 1);
  };
  Scene clear = empty_scene(fog(0.0, 0.0)), screened = empty_scene(fog(0.2, 0.0));
  wall(clear);
  wall(screened);
  // A screen of 2 m thickness in front, high and low enough to cover every ray to the wall.
  add_box(screened, {60.0, 40.0, 2.0}, 0.0, {0.0, -1.0, 4.0});
  Image<float> expected = render(clear, view);
  const double path_m = 2.0 / std::sin(rad_from_deg(45.0));
  for (float& p : expected.pixels()) p *= float(std::exp(-2.0 * 0.2 * path_m));
  CHECK(relative_l2(render(screened, view), expected) < 2e-3);
}

TEST_CASE("extinctions going in and coming back add up, whichever carries them", "[media]") {
  const Acquisition view = view_of(45.0, 1e4, 32, 64);
  Material in = fog(0.3, 0.2), back = fog(0.0, 0.2), both = fog(0.15, 0.2);
  in.extinction_back_per_m = 0.0;
  back.extinction_back_per_m = 0.3;
  Image<float> images[3];
  int n = 0;
  for (const Material& m : {in, back, both}) {
    Scene scene = empty_scene(m);
    add_box(scene, {6.0, 4.0, 5.0}, 0.3);
    images[n++] = render(scene, view);
  }
  CHECK(relative_l2(images[0], images[2]) < 1e-5);
  CHECK(relative_l2(images[1], images[2]) < 1e-5);
}

TEST_CASE("overlapping solids add", "[media]") {
  const Acquisition view = view_of(45.0, 1e4, 32, 64);
  Scene twice = empty_scene(fog(0.1, 0.05)), once = empty_scene(fog(0.2, 0.1));
  add_box(twice, {6.0, 4.0, 5.0}, 0.3);
  add_box(twice, {6.0, 4.0, 5.0}, 0.3);
  add_box(once, {6.0, 4.0, 5.0}, 0.3);
  CHECK(relative_l2(render(twice, view), render(once, view)) < 1e-5);
}

TEST_CASE("matter nearer than the first bin still attenuates", "[media]") {
  Scene scene = empty_scene(fog(0.2, 0.0));
  scene.materials.push_back(matte());
  add_piece(scene, {{-20, 0, 0}, {20, 0, 0}, {20, 2, 0}, {-20, 2, 0}}, {{0, 1, 2}, {0, 2, 3}}, false, 1);
  add_box(scene, {60.0, 60.0, 2.0}, 0.0, {0.0, -1.0, 20.0});
  Acquisition view = view_of(45.0, 1e5, 4, 16);
  const Image<float> image = render(scene, view);
  const double path_m = 2.0 / std::sin(rad_from_deg(45.0));
  CHECK(image(2, 5) == Approx(std::exp(-0.4 * path_m)).epsilon(0.005));
}

TEST_CASE("every integrator is reachable, and they agree on thin media", "[media]") {
  const Acquisition view = view_of(45.0, 1e4, 16, 64);
  Scene scene = empty_scene(fog(0.001, 0.01));
  add_box(scene, {6.0, 4.0, 5.0}, 0.3);
  const Image<float> exact = render(scene, view);
  for (const Integrator integrator : {Integrator::midpoint, Integrator::paper}) {
    Sampling sampling;
    sampling.integrator = integrator;
    CHECK(relative_l2(render(scene, view, sampling), exact) < 0.01);
  }
}

TEST_CASE("in dense media each integrator gives an image of its own", "[media]") {
  const Acquisition view = view_of(45.0, 1e4, 16, 64);
  Scene scene = empty_scene(fog(2.0, 1.0));  // a two-way optical depth of about 1 in a bin
  add_box(scene, {6.0, 4.0, 5.0}, 0.3);
  std::vector<Image<float>> images;
  for (const Integrator integrator : {Integrator::exact, Integrator::midpoint, Integrator::paper, Integrator::paper_gated}) {
    Sampling sampling;
    sampling.integrator = integrator;
    images.push_back(render(scene, view, sampling));
    for (std::size_t n = 0; n + 1 < images.size(); ++n) {
      CAPTURE(name(integrator), n);
      CHECK(relative_l2(images.back(), images[n]) > 0.02);
    }
  }
}
