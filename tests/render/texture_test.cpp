// SPDX-License-Identifier: Apache-2.0
// Checkers finer than pixels: their mean is 1 however fine they are.
#include "appearance.h"
#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

Material checkered(double period_m) {
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
  Scene scene = empty_scene(checkered(period_m));
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
    CHECK(table.training_images.front().checker.has_value() == drawn);
  }
}
