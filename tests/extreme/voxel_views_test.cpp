// SPDX-License-Identifier: Apache-2.0
// The voxel engine at every range and spacing, and in volumes of ten million voxels a side.
#include <random>

#include "catch.h"
#include "extreme_scenes.h"
#include "matrix.h"
#include "quad_geometry.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Bins beside an edge that voxels of half a bin blur.
constexpr int kEdgeBins = 4;

}  // namespace

TEST_CASE("planes of voxels, at every range and spacing", "[geometry]") {
  std::mt19937 random(33);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  int n_views = 0;
  for (const double range_m : kRanges_m) {
    for (const double spacing_m : {1e-3, 0.3, 100.0}) {
      for (const bool wall : {false, true}) {
        // Within 15° of edge-on, half a voxel of rounding is many bins.
        const double pitch = wall ? 15.0 + 74.5 * unit(random) : 0.5 + 74.5 * unit(random);
        Acquisition a = extreme_view(range_m, pitch, spacing_m, 3, 48);
        if (a.range_m(-0.5) <= 0.0) continue;
        a.azimuth_rad = 6.0 * unit(random);
        a.aim_m = {500123.25, 80.5, -4000321.75};
        const auto extent = wall ? wall_of_bins(a, 32) : roof_of_bins(a, 32);
        if (!extent || extent->height_m + extent->half_m > 500.0 * spacing_m) continue;
        ++n_views;
        INFO(text_of(a) << (wall ? ", wall" : ", roof"));
        const Image<float> image = render_voxels(wall ? wall_scene(a, *extent) : roof_scene(a, *extent), a, 0.5 * spacing_m);
        CHECK(sound(image));
        const KnownPlane plane = wall ? KnownPlane::wall(a, 0.0, extent->height_m)
                                      : KnownPlane::level(a, extent->height_m, -extent->half_m, extent->half_m);
        const double error = worst_error(image, plane, kEdgeBins);
        record(Case::voxel_planes, error);
        CHECK(error < 0.02);
      }
    }
  }
  CHECK(n_views > 20);
}

TEST_CASE("a wall in a volume of up to ten million voxels a side", "[geometry]") {
  Acquisition a = extreme_view(3.6e7, 40.0, 0.3, 9, 48);
  a.azimuth_rad = 1.0;
  const auto extent = wall_of_bins(a, 24);
  REQUIRE(extent);
  Image<float> near;
  for (const double reach_m : {100.0, 1.5e4, 1.5e6}) {
    INFO("reaching " << reach_m << " m");
    Scene scene = wall_scene(a, *extent);
    // The lattice begins at the box's lowest corner: whole voxels away, so that all walls lie alike in it.
    const double far_m = std::floor(reach_m / 0.15) * 0.15;
    add_sheet(scene, scene.box.min - far_m, {0.3, 0.0, 0.0}, {0.0, 0.0, 0.3});
    const Image<float> image = render_voxels(scene, a, 0.15);
    CHECK(sound(image));
    if (near.pixels().empty()) near = image;
    const double error = relative_l2(image, near);
    record(Case::voxel_reach, error);
    CHECK(error < 1e-3);
  }
  CHECK(worst_error(near, KnownPlane::wall(a, 0.0, extent->height_m), kEdgeBins) < 0.02);
}
