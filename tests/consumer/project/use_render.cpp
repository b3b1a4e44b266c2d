// SPDX-License-Identifier: Apache-2.0
#include <sarnerf/core/error.h>
#include <sarnerf/core/units.h>
#include <sarnerf/render/engine.h>
#include <sarnerf/render/framing.h>
#include <sarnerf/scene/scene.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>

namespace {

constexpr double kSide_m = 4.0;

void write_cube(const std::filesystem::path& path) {
  std::ofstream obj(path);
  for (int n = 0; n < 8; ++n) {
    obj << "v " << (n & 1 ? kSide_m : 0.0) << ' ' << (n & 2 ? kSide_m : 0.0) << ' '
        << (n & 4 ? kSide_m : 0.0) << '\n';
  }
  obj << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

}  // namespace

/// Images a cube. With γ = |n·d| a face of area A scatters A (n·d)², and the squares of the cosines to the three
/// axes add up to one: the image's total power is the side squared, from wherever the cube is seen.
int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  write_cube(folder / "cube.obj");
  const sarnerf::Scene scene = sarnerf::load_scene(folder / "cube.obj", {});

  sarnerf::Acquisition view;
  view.azimuth_rad = sarnerf::rad_from_deg(25.0);
  view.incidence_rad = sarnerf::rad_from_deg(40.0);
  view.slant_range_m = 10'000.0;
  view.aim_m = sarnerf::default_aim_m(scene);
  view.azimuth_spacing_m = view.range_spacing_m = 0.1;
  const sarnerf::Framing framing = sarnerf::frame_scene(scene, std::span(&view, 1));
  view.n_azimuth = framing.n_azimuth;
  view.n_range = framing.n_range;

  const sarnerf::SurfaceEngine engine(scene);
  const sarnerf::RenderedView image = engine.render(engine.plan(view, {}));

  double power_m2 = 0.0;
  for (const float pixel : image.beta0.pixels()) power_m2 += pixel;
  power_m2 *= view.azimuth_spacing_m * view.range_spacing_m;
  std::printf("total power %g m2, expected %g m2\n", power_m2, kSide_m * kSide_m);
  return std::abs(power_m2 / (kSide_m * kSide_m) - 1.0) < 0.02 ? 0 : 1;
} catch (const sarnerf::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
