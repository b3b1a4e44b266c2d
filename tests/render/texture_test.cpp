// SPDX-License-Identifier: Apache-2.0
// Checkers finer than pixels: their mean is 1 however fine they are.
#include "appearance.h"
#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Material black_and_white(double period_m) {
  Material material = matte(1.0);
  if (period_m == 0.0) return material;
  material.texture.kind = Texture::Kind::checker;
  material.texture.period_m = period_m;
  material.texture.contrast = 1.0;
  return material;
}

double power(const Scene& scene, double turn_deg) {
  const SurfaceEngine engine(scene);
  const RenderedView view = engine.render(engine.plan(view_of(35.0, 1e4, 128, 128, 0.3, turn_deg), {}));
  double sum = 0.0;
  for (const float p : view.beta0.pixels()) sum += p;
  return sum;
}

/// A block so long that single precision stops short of the finest squares, and the ground around it.
Scene block(double period_m, bool ground) {
  Scene scene = empty_scene(black_and_white(period_m));
  add_box(scene, {20.0, 10.0, 20.0});
  if (ground) scene.ground = Ground{0, 0.0};
  return scene;
}

}  // namespace

TEST_CASE("checkers far finer than a pixel leave the power alone, whatever single precision holds", "[texture]") {
  for (const bool ground : {false, true}) {
    for (const double turn_deg : {0.0, 30.0}) {
      const double plain = power(block(0.0, ground), turn_deg);
      for (const double period_m : {0.0123, 1e-3, 2e-4, 1.2e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7, 1e-9}) {
        INFO("period " << period_m << " ground " << ground << " turn " << turn_deg);
        CHECK(power(block(period_m, ground), turn_deg) == Approx(plain).epsilon(0.03));
      }
    }
  }
}

TEST_CASE("squares that single precision holds are drawn, finer ones are left out", "[texture]") {
  const double reach_m = 30.0;  // the box's diagonal
  for (const auto& [period_m, drawn] : {std::pair{reach_m / (1 << 18) * 1.01, true}, {reach_m / (1 << 18) * 0.99, false}}) {
    const Scene scene = block(period_m, false);
    const AppearanceTable table = make_appearances(scene, {0}, scene.box.centre());
    CHECK(table.appearances.front().checker.has_value() == drawn);
  }
}

TEST_CASE("a ground of squares that hardly differ is the uniform ground, also beside a mesh at the border of the swath", "[texture]") {
  Material squares = black_and_white(1.0);
  squares.texture.contrast = 1e-6;
  Acquisition view = view_of(45.0, 1e4, 16, 64);
  const glm::dvec3 away = glm::normalize(glm::dvec3(radar_frame(view).k.x, 0.0, radar_frame(view).k.z));
  const double border_m = 0.5 * view.n_range * view.range_spacing_m / std::sin(view.incidence_rad);
  for (const double beyond_m : {-1.0, -0.1, 0.0, 0.3, 0.6, 1.0, 2.0}) {
    for (const double side : {-1.0, 1.0}) {
      CAPTURE(beyond_m, side);
      const auto image_on = [&](const Material& material) {
        Scene scene = empty_scene(material);
        scene.materials.push_back(matte(1.0));
        // A slab too flat to hide or lay over much.
        add_box(scene, {2.0, 0.02, 2.0}, 0.0, side * (border_m - beyond_m) * away, 1);
        scene.ground = Ground{0, 0.0};
        const SurfaceEngine engine(scene);
        Sampling sampling;
        sampling.n_elevation = 40;
        sampling.n_slices = 3;
        return engine.render(engine.plan(view, sampling)).beta0;
      };
      CHECK(relative_l2(image_on(squares), image_on(matte(1.0))) < 1e-3);
    }
  }
}
