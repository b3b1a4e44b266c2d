// SPDX-License-Identifier: Apache-2.0
// Translucent solids from next to nothing to denser than anything, through both engines.
#include "catch.h"
#include "extreme_scenes.h"
#include "matrix.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kWidth_m = 12.0, kHeight_m = 7.0, kVoxel_m = 0.15;

/// Σ_j β⁰_j Δr of a row through a box of matter, plane waves: the integral over parallel rays of what each of
/// them returns, P (1 − e^−2κL)/(2κ) over its chord L.
double expected_row(double incidence_rad, double extinction_per_m, double scattering_per_m) {
  constexpr int kRays = 20000;
  const double s = std::sin(incidence_rad), c = std::cos(incidence_rad);
  const double across_m = kWidth_m * c + kHeight_m * s;
  const double longest_m = std::min(kWidth_m / s, kHeight_m / c);
  double sum = 0.0;
  for (int n = 0; n < kRays; ++n) {
    // Chords grow from either corner until they are longest.
    const double from_corner_m = across_m * std::min(n + 0.5, kRays - n - 0.5) / kRays;
    const double length_m = std::min(longest_m, from_corner_m / (s * c));
    const double depth = 2.0 * extinction_per_m * length_m;
    sum += scattering_per_m * length_m * (depth > 0.0 ? -std::expm1(-depth) / depth : 1.0);
  }
  return sum * across_m / kRays;
}

}  // namespace

TEST_CASE("boxes of matter with extinctions from 0 to 1e30", "[geometry]") {
  for (const double extinction : {0.0, 1e-30, 1e-10, 1e-3, 0.1, 1.0, 1e2, 1e6, 1e15, 1e30}) {
    for (const double scattering : {1e-30, 1.0, 1e12}) {
      INFO("extinction " << extinction << ", scattering " << scattering);
      Scene scene = empty_scene(fog(extinction, scattering));
      add_box(scene, {8.0, kHeight_m, kWidth_m});
      Acquisition a = view_of(40.0, 7e5, 3, 96);
      const double expected = expected_row(a.incidence_rad, extinction, scattering);
      const Image<float> surface = render_surface(scene, a);
      CHECK(sound(surface));
      // Pixels below the smallest normal float have no digits to compare.
      if (expected < 1e-36) continue;
      const double error = collected(surface, a) / expected - 1.0;
      record(Case::media, error);
      CHECK(std::abs(error) < 0.01);
      if (scattering != 1.0) continue;
      const Image<float> voxels = render_voxels(scene, a, kVoxel_m);
      CHECK(sound(voxels));
      const double voxel_error = collected(voxels, a) / expected - 1.0;
      record(Case::voxel_media, voxel_error);
      // Voxels move each face by less than a voxel.
      CHECK(std::abs(voxel_error) < 2.0 * kVoxel_m / kHeight_m);
    }
  }
}
