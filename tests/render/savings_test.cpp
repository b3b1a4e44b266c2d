// SPDX-License-Identifier: Apache-2.0
// What is left out of the work is not missed in the image (docs/design.md, Rules).
#include "catch.h"
#include "voxel_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A speck that scatters nothing, so far from the origin that the scene's box doubles on every side.
void add_unseen_speck(Scene& scene, const glm::dvec3& at_m) {
  scene.materials.push_back(matte(1.0, 0.0));
  add_box(scene, glm::dvec3(0.01), 0.0, at_m, static_cast<std::uint32_t>(scene.materials.size() - 1));
}

}  // namespace

TEST_CASE("rays that miss the box are not missed: surfaces", "[savings]") {
  Scene tight = empty_scene(matte(1.0));
  add_box(tight, {9.0, 5.0, 6.0}, 0.5);
  Scene wide = tight;
  // Above and before the building, and to its side: where none of its rays pass.
  add_unseen_speck(wide, {-17.0, 0.0, 16.0});
  add_unseen_speck(wide, {17.0, 0.0, -12.0});
  for (const bool ground : {false, true}) {
    if (ground) tight.ground = wide.ground = Ground{0, 0.0};
    const Acquisition view = view_of(45.0, 1e4, 96, 96);
    const SurfaceEngine few(tight), many(wide);
    const ViewPlan few_rays = few.plan(view, {}), many_rays = many.plan(view, {});
    CHECK(few_rays.n_kept_rays * 2 < many_rays.n_kept_rays);
    // The plan's rays lie on one lattice whatever the box, so that the same ones meet the building. The
    // specks' shadows on the ground are smaller than a pixel.
    CHECK(relative_l2(few.render(few_rays).beta0, many.render(many_rays).beta0) < (ground ? 2e-3 : 1e-6));
  }
}

TEST_CASE("empty voxels are not missed: a second extinction that equals the first, and empty bricks around",
          "[savings]") {
  const Box box{{-4.0, 0.0, -4.0}, {4.0, 5.0, 4.0}};
  const auto ball = [](const glm::dvec3& p) { return glm::length(p - glm::dvec3(0.0, 2.5, 0.0)) < 2.2 ? 1.0 : 0.0; };
  const Volume one = volume_where(0.2, box, {0.4f, 0.3f}, {false, 0, SourceBasis::scattering}, ball);
  const Volume two = volume_where(0.2, box, {0.4f, 0.4f, 0.3f}, {true, 0, SourceBasis::scattering}, ball);
  Volume padded = one;
  for (int n = -9; n < 9; ++n) padded.grid.touch_brick({n, n, -n});
  const Acquisition view = view_of(50.0, 1e4, 48, 64);
  const Scene scene;
  const auto render = [&](const Volume& volume) {
    const VoxelEngine engine(scene, volume);
    return engine.render(engine.plan(view, {})).beta0;
  };
  const Image<float> image = render(one);
  CHECK(sum(image) > 0.0);
  CHECK(relative_l2(render(two), image) < 1e-6);
  CHECK(relative_l2(render(padded), image) < 1e-6);
}

TEST_CASE("the plan counts the rays of a scene narrower than a row, wherever it lies between rows", "[savings]") {
  for (const double aside_m : {0.0, 0.2, 0.4, 0.5, 0.9}) {
    CAPTURE(aside_m);
    Acquisition view = view_of(45.0, 1e4, 8, 64);
    view.azimuth_spacing_m = 1.0;
    Scene scene = empty_scene(matte(1.0));
    add_box(scene, {0.3, 3.0, 0.3}, 0.0, aside_m * radar_frame(view).h);
    const SurfaceEngine engine(scene);
    const ViewPlan plan = engine.plan(view, {});
    CHECK(plan.n_kept_rays > 0);
    CHECK(plan.n_scene_slices >= 6);
    CHECK(plan.n_scene_slices <= static_cast<std::uint64_t>(plan.n_slices));
    Sampling coarse;
    coarse.n_slices = 1;
    CHECK(engine.plan(view, coarse).n_scene_slices <= 2);
    CHECK(std::isnan(engine.render(engine.plan(view, coarse)).error.relative));
  }
}
