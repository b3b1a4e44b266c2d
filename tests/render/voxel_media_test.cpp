// SPDX-License-Identifier: Apache-2.0
// Translucent matter in voxels against closed forms.
#include "catch.h"
#include "voxel_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

TEST_CASE("separate extinctions going in and coming back, factors up to a million apart", "[voxel]") {
  // Looking straight along z through a slab of exactly constant voxels.
  const double voxel = 0.1, length = 3.0;
  const Box box{{-6.0, -4.0, -0.5 * length}, {6.0, 4.0, 0.5 * length}};
  for (const double factor : {1.0, 1e-3, 1e3, 1e6, 1e-6}) {
    for (const double depth : {0.01, 1.0, 30.0}) {
      INFO("factor " << factor << ", depth " << depth);
      const double sum = depth / length, forth = sum / (1.0 + factor), back = sum - forth;
      const double scattering = 0.4 * sum;
      const FieldChannels layout{true, 0, SourceBasis::scattering};
      const Volume volume = volume_where(voxel, box, {float(forth), float(back), float(scattering)}, layout,
                                         [](const glm::dvec3&) { return 1.0; });
      Scene scene;
      scene.box = volume.box_m;
      const VoxelEngine engine(scene, volume);
      Acquisition view = view_of(89.0, 1.0, 8, 96, 0.1);
      view.slant_range_m = 1e5;
      const Image<float> image = engine.render(engine.plan(view, {})).beta0;
      // Rays through the middle: constant matter over the length, and ramps of one voxel at both ends.
      const double length_seen = length + voxel;
      const double height = 8.0 + voxel;
      const double expected = height * 0.4 * -std::expm1(-sum * length_seen);
      CHECK(collected(image, view) == Approx(expected).epsilon(0.02));
    }
  }
}

TEST_CASE("a ball of fog returns its analytic integral", "[voxel]") {
  // Mass P times its cut's area where extinction is negligible, and ∫ (1 − e^(−2κℓ)) P/2κ else, over
  // the chords ℓ of the middle row's disc.
  const double radius = 3.0, voxel = 0.03;
  const Box box{glm::dvec3(-radius - voxel), glm::dvec3(radius + voxel)};
  const auto coverage = [&](const glm::dvec3& p) {
    return std::clamp(0.5 + (radius - glm::length(p)) / voxel, 0.0, 1.0);
  };
  for (const double kappa : {1e-6, 0.05, 0.5}) {
    INFO("kappa " << kappa);
    const double scattering = 0.3;
    const Volume volume = volume_where(voxel, box, {float(kappa), float(scattering)},
                                       {false, 0, SourceBasis::scattering}, coverage);
    Scene scene;
    scene.box = volume.box_m;
    const VoxelEngine engine(scene, volume);
    const Acquisition view = view_of(45.0, 1e6, 1, 128, 0.1);
    const Image<float> image = engine.render(engine.plan(view, {.n_slices = 16})).beta0;
    double expected = 0.0;
    const int n = 20000;
    for (int m = 0; m < n; ++m) {
      const double b = radius * (2.0 * (m + 0.5) / n - 1.0), chord = 2.0 * std::sqrt(radius * radius - b * b);
      expected += scattering * -std::expm1(-2.0 * kappa * chord) / (2.0 * kappa) * 2.0 * radius / n;
    }
    CHECK(collected(image, view) == Approx(expected).epsilon(1e-3));
  }
}

TEST_CASE("voxelised media agree with the closed forms of the surface engine", "[voxel]") {
  Scene scene = empty_scene(fog(0.2, 0.05));
  scene.materials.push_back(matte(1.0));
  add_box(scene, {10.0, 4.0, 3.0}, 0.2, {0.0, 0.0, 4.0});
  add_box(scene, {12.0, 6.0, 4.0}, 0.2, {0.0, 0.0, -3.0}, 1);
  const Acquisition view = view_of(45.0, 1e4, 64, 80);
  const Image<float> reference = render_surface(scene, view);
  const double coarse = relative_l2(render_voxels(scene, view, 0.15), reference);
  const double fine = relative_l2(render_voxels(scene, view, 0.05), reference);
  CHECK(fine < 0.05);
  CHECK(fine < coarse / 2.5);
}

TEST_CASE("a hedge before a wall attenuates it as exp(-two-way depth)", "[voxel]") {
  const Acquisition view = view_of(45.0, 1e5, 8, 128);
  const auto wall = [](Scene& scene) {
    scene.materials.push_back(matte());
    add_box(scene, {40.0, 5.0, 2.0}, 0.0, {0.0, 0.0, -1.0}, 1);
  };
  Scene clear = empty_scene(fog(0.0, 0.0)), screened = empty_scene(fog(0.2, 0.0));
  wall(clear);
  wall(screened);
  // A screen of 2 m thickness in front, high and low enough to cover every ray to the wall.
  add_box(screened, {60.0, 40.0, 2.0}, 0.0, {0.0, -1.0, 8.0});
  const Image<float> unattenuated = render_voxels(clear, view, 0.1);
  const Image<float> image = render_voxels(screened, view, 0.1);
  const double path_m = 2.0 / std::sin(rad_from_deg(45.0));
  CHECK(collected(image, view) / collected(unattenuated, view) ==
        Approx(std::exp(-2.0 * 0.2 * path_m)).epsilon(0.01));
}

TEST_CASE("interiors of media are tiles, and memory grows with matter, not with the box around it", "[voxel]") {
  const auto two_boxes = [](double apart_m) {
    Scene scene = empty_scene(matte());
    add_box(scene, {4.0, 4.0, 4.0});
    add_box(scene, {4.0, 4.0, 4.0}, 0.0, {apart_m, 0.0, 0.0});
    return voxels_of(scene, 0.1);
  };
  // Whole bricks apart, so that both cut the boxes alike.
  const Volume near = two_boxes(16.0), far = two_boxes(16000.0);
  CHECK(double(far.n_occupied_voxels) == Approx(double(near.n_occupied_voxels)).epsilon(0.01));
  CHECK(double(far.memory_bytes()) < 1.1 * double(near.memory_bytes()));

  Scene fog_scene = empty_scene(fog(0.1, 0.1));
  add_box(fog_scene, {12.0, 12.0, 12.0});
  VoxeliseOptions options;
  options.voxel_size_m = 0.1;
  const VdbScene voxels = voxelise(fog_scene, options);
  const auto grids = voxels.summary().grids;
  CHECK(double(grids.front().n_active_voxels) == Approx(120.0 * 120.0 * 120.0).epsilon(0.03));
  CHECK(grids.front().memory_bytes < 3 * grids.front().n_active_voxels);
}
