// SPDX-License-Identifier: Apache-2.0
// The voxel engine against what is known on paper, and against the surface engine.
#include <algorithm>
#include <cstdio>

#include "catch.h"
#include "sarnerf/core/parallel.h"
#include "voxel_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

TEST_CASE("voxels of half a bin: wall, roof, overlap and ground have their brightness", "[voxel]") {
  for (const double pitch : {35.0, 45.0, 55.0}) {
    for (const double width : {8.0, 14.0}) {
      INFO("pitch " << pitch << ", width " << width);
      const double height = 8.0, theta = rad_from_deg(pitch);
      Scene scene = empty_scene(matte(1.0));
      scene.materials.push_back(matte(1.0, 0.1));
      add_box(scene, {24.0, height, width});
      scene.ground = Ground{1, 0.0};
      const Acquisition view = view_of(pitch, 1e5, 16, 160);
      const Image<float> image = render_voxels(scene, view, 0.15);
      const double wall = std::sin(theta) * std::tan(theta);
      const double roof = std::cos(theta) / std::tan(theta);
      const double ground = 0.1 * roof;
      const double front = 0.5 * width, base = -front * std::sin(theta);
      const double tip = base - height * std::cos(theta);
      const double roof_end = tip + width * std::sin(theta);
      const double shadow_end = base + (width + height * std::tan(theta)) * std::sin(theta);
      int n_checked = 0;
      for (int j = 0; j < view.n_range; ++j) {
        const double near_m = view.bin_offset_m(j - 0.5), far_m = view.bin_offset_m(j + 0.5);
        // A voxel's width on either side of an edge belongs to neither.
        const auto within = [&](double a, double b) { return near_m > a + 0.5 && far_m < b - 0.5; };
        const auto beyond = [&](double a, double b) { return far_m < a - 0.5 || near_m > b + 0.5; };
        double expected = 0.0;
        bool known = true;
        const auto add = [&](double value, double a, double b) {
          if (within(a, b)) {
            expected += value;
          } else if (!beyond(a, b)) {
            known = false;
          }
        };
        add(wall, tip, base);
        add(roof, tip, roof_end);
        add(ground, -1e9, base);
        add(ground, shadow_end, 1e9);
        if (!known) continue;
        ++n_checked;
        CHECK(image(7, j) == Approx(expected).epsilon(0.02).margin(1e-4));
      }
      CHECK(n_checked > 100);
    }
  }
}

TEST_CASE("images converge to the surface engine's with the voxel size", "[voxel]") {
  Scene scene = empty_scene(matte(1.0));
  add_box(scene, {10.0, 6.0, 8.0}, rad_from_deg(30.0));
  const Acquisition view = view_of(45.0, 1e4, 64, 64);
  const SurfaceEngine surface(scene);
  Sampling fine;
  fine.n_elevation = 4 * surface.plan(view, {}).fan.n_elevation;
  fine.n_slices = 32;
  const Image<float> reference = render_surface(scene, view, fine);
  const double coarse_error = relative_l2(render_voxels(scene, view, 0.3), reference);
  const double fine_error = relative_l2(render_voxels(scene, view, 0.075), reference);
  const double slope = std::log2(coarse_error / fine_error) / 2.0;
  std::printf("building turned by 30 degrees: E %.3f at one bin, %.3f at a quarter, slope %.2f\n",
              coarse_error, fine_error, slope);
  CHECK(slope > 1.0);
  CHECK(fine_error < 0.1);
}

TEST_CASE("thin sheets and boxes thinner than a voxel stay opaque", "[voxel]") {
  const Acquisition view = view_of(45.0, 1e4, 16, 96);
  for (const double thickness : {0.0, 0.01, 0.1, 0.3}) {
    INFO("thickness " << thickness);
    Scene scene = empty_scene(matte(0.0));
    scene.materials.push_back(matte(0.0));
    if (thickness > 0.0) {
      add_box(scene, {40.0, 6.0, thickness});
    } else {
      add_sheet(scene, {-20.0, 0.0, 0.0}, {40.0, 0.0, 0.0}, {0.0, 6.0, 0.0});
    }
    scene.ground = Ground{1, 0.0};
    const Image<float> image = render_voxels(scene, view, 0.3);
    // In the middle of the wall's shadow nothing shines through.
    const int behind = view.n_range / 2 + static_cast<int>(2.0 / view.range_spacing_m);
    CHECK(image(8, behind) < 1e-4f);
    const Image<float> wall_alone = [&] {
      Scene alone = scene;
      alone.ground.reset();
      return render_voxels(alone, view, 0.3);
    }();
    // It answers up to a voxel early on all sides: that much is too bright, and nothing is missing.
    const double expected = (6.0 + thickness) * std::sin(rad_from_deg(45.0));
    CHECK(collected(wall_alone, view) > 0.99 * expected);
    CHECK(collected(wall_alone, view) < expected + 3.0 * 0.3);
  }
}

TEST_CASE("a sheet whose back nobody sees answers where it is", "[voxel]") {
  // Roof and walls of a house, drawn without a floor: an open piece.
  Scene house = empty_scene(matte(1.0)), solid = empty_scene(matte(1.0));
  add_box(solid, {10.0, 5.0, 8.0}, 0.4);
  add_box(house, {10.0, 5.0, 8.0}, 0.4);
  auto& mesh = house.mesh;
  mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 2);  // the floor
  for (auto* array : {&mesh.material, &mesh.piece, &mesh.group}) array->resize(mesh.triangles.size());
  house.pieces.front().closed = false;
  // What no radar sees is below the rim: a ground to stand on closes it.
  const Acquisition view = view_of(45.0, 1e4, 64, 64);
  const Image<float> reference = render_surface(solid, view);
  const double as_solid = relative_l2(render_voxels(solid, view, 0.15), reference);
  const double as_house = relative_l2(render_voxels(house, view, 0.15), reference);
  CHECK(as_house < 1.3 * as_solid);
}

TEST_CASE("material, texture and exponent reach the voxels", "[voxel]") {
  Material checkered = matte(2.0, 0.8);
  checkered.texture = {Texture::Kind::checker, 2.0, 0.25, {}};
  Scene scene = empty_scene(checkered);
  add_box(scene, {12.0, 6.0, 8.0}, 0.3);
  const Acquisition view = view_of(45.0, 1e4, 64, 64);
  const Image<float> reference = render_surface(scene, view);
  const double coarse = relative_l2(render_voxels(scene, view, 0.15), reference);
  const double fine = relative_l2(render_voxels(scene, view, 0.05), reference);
  CHECK(fine < 0.05);
  CHECK(fine < coarse / 2.5);
}

TEST_CASE("voxel images do not depend on threads, on where the scene stands, or on what is off", "[voxel]") {
  Scene scene = empty_scene(matte(1.0));
  scene.materials.push_back(matte(1.0, 0.1));
  add_box(scene, {8.0, 5.0, 6.0}, 0.6);
  scene.ground = Ground{1, 0.0};
  const Acquisition view = view_of(40.0, 1e4, 48, 64);
  const VoxelEngine engine(scene, voxels_of(scene, 0.2));
  const Image<float> image = engine.render(engine.plan(view, {})).beta0;
  SECTION("threads") {
    const ThreadLimit one(1);
    const Image<float> again = engine.render(engine.plan(view, {})).beta0;
    CHECK(std::equal(image.pixels().begin(), image.pixels().end(), again.pixels().begin()));
  }
  SECTION("map coordinates") {
    const glm::dvec3 shift(500000.0, 0.0, 5000000.0);
    Scene far = empty_scene(matte(1.0));
    far.materials.push_back(matte(1.0, 0.1));
    add_box(far, {8.0, 5.0, 6.0}, 0.6, shift);
    far.ground = Ground{1, 0.0};
    Acquisition there = view;
    there.aim_m += shift;
    CHECK(relative_l2(render_voxels(far, there, 0.2), image) < 1e-4);
  }
}
