// SPDX-License-Identifier: Apache-2.0
// Scenes of few pixels: automatic sampling keeps their energy.
#include <string>

#include "catch.h"
#include "scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Σ β⁰ Δa Δr.
double energy(const Scene& scene, double spacing_m, double shift_m, double azimuth_deg) {
  const int n = std::max(8, static_cast<int>(40.0 / spacing_m));
  Acquisition view = view_of(40.0, 1e4, n, n, spacing_m, azimuth_deg);
  view.aim_m = {shift_m, 0.0, 0.6 * shift_m};
  const SurfaceEngine engine(scene);
  const RenderedView rendered = engine.render(engine.plan(view, {}));
  return sum(rendered.beta0) * spacing_m * spacing_m;
}

}  // namespace

TEST_CASE("an object's energy does not depend on how coarse the pixels are", "[coarse]") {
  for (const double size_m : {0.2, 2.0, 6.0}) {
    for (const double azimuth_deg : {0.0, 33.0}) {
      Scene scene = empty_scene(matte(1.0));
      add_box(scene, {size_m, 1.5 * size_m, size_m});
      const double expected = energy(scene, 0.02 * size_m, 0.0, azimuth_deg);
      for (const double spacing_m : {0.3, 1.0, 5.0, 30.0}) {
        // Finer ones are the reference; of hundredths of a pixel the program warns.
        if (spacing_m < 0.04 * size_m || spacing_m > 50.0 * size_m) continue;
        for (const double shift_m : {0.0, 0.013, 0.37, 1.9}) {
          INFO("a box of " << size_m << " m at " << spacing_m << " m, azimuth " << azimuth_deg << ", shifted by " << shift_m);
          CHECK(energy(scene, spacing_m, shift_m, azimuth_deg) == Approx(expected).epsilon(0.01));
        }
      }
    }
  }
}
