// SPDX-License-Identifier: Apache-2.0
#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

bool mentions(const std::vector<std::string>& lines, const std::string& text) {
  for (const std::string& line : lines) {
    if (line.find(text) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("a trihedral comes with the warning that bounces are missing", "[warnings]") {
  Scene scene = empty_scene(matte());
  add_piece(scene, {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}}, false);
  CHECK(mentions(SurfaceEngine(scene).warnings(), "corner reflectors"));
}

TEST_CASE("convex right angles are no corner reflectors", "[warnings]") {
  Scene scene = empty_scene(matte());
  add_box(scene, {2.0, 2.0, 2.0});
  CHECK(SurfaceEngine(scene).warnings().empty());
}

TEST_CASE("dark scenes say so", "[warnings]") {
  Scene scene = empty_scene(matte(1.0, 0.0));
  add_box(scene, {2.0, 2.0, 2.0});
  const SurfaceEngine engine(scene);
  CHECK(mentions(engine.render(engine.plan(view_of(45.0), {})).warnings, "gamma0"));
}

TEST_CASE("dense media that an integrator makes vanish say so, thin and dark ones do not", "[warnings]") {
  const auto warnings_of = [](const Material& material, Integrator integrator) {
    Scene scene = empty_scene(material);
    add_box(scene, {4.0, 4.0, 4.0});
    const SurfaceEngine engine(scene);
    Sampling sampling;
    sampling.integrator = integrator;
    return engine.render(engine.plan(view_of(45.0), sampling)).warnings;
  };
  for (const Integrator integrator : {Integrator::midpoint, Integrator::paper}) {
    CHECK(mentions(warnings_of(fog(1e9, 1e9), integrator), "--integrator " + std::string(name(integrator))));
    CHECK(warnings_of(fog(0.1, 0.1), integrator).empty());
    CHECK(mentions(warnings_of(fog(1e9, 0.0), integrator), "scattering_per_m"));
  }
  CHECK(warnings_of(fog(1e9, 1e9), Integrator::exact).empty());
}

TEST_CASE("a sheet turned away says that nothing faces the radar", "[warnings]") {
  Scene scene = empty_scene(matte(1.0));
  add_sheet(scene, {-2, 0, 0}, {0, 2, 0}, {4, 0, 0}, true);  // front towards −Z, away from the radar
  const SurfaceEngine engine(scene);
  CHECK(mentions(engine.render(engine.plan(view_of(45.0), {})).warnings, "turned away"));
}
