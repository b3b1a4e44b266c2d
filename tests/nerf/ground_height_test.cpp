// SPDX-License-Identifier: Apache-2.0
// Where the ground lies whose texture speckled views share.
#include "ground/median_ground.h"

#include "ground_scene.h"
#include "sarnerf/core/error.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

/// The box of ground_scene(), whose ground is at 0, with its bottom elsewhere.
Box box_from(double bottom_m) {
  Box box = ground_scene_box();
  box.min.y = bottom_m;
  return box;
}

/// Speckle on a ground without texture.
std::vector<PosedImage> featureless_scene(int n_views) {
  auto images = speckled_scene(n_views, 1.0);
  std::mt19937 random(11);
  std::exponential_distribution<float> speckle(10.0f);
  for (PosedImage& image : images)
    for (float& p : image.power.pixels()) p = speckle(random);
  return images;
}

}  // namespace

TEST_CASE("speckled views tell the height of a ground by its texture") {
  const auto images = speckled_scene(36, 1.0);
  // A pixel of slant range is 0.57 m of height here.
  for (const double bottom_m : {1.3, -1.1}) {
    const auto height_m = ground_height_m(images, box_from(bottom_m));
    REQUIRE(height_m.has_value());
    CHECK(*height_m == Approx(0.0).margin(0.15));
    CHECK(training_set(images, box_from(bottom_m)).box_m.min.y == *height_m);
  }
}

TEST_CASE("a ground at the bottom of the box stays there") {
  const auto height_m = ground_height_m(speckled_scene(36, 1.0), box_from(0.0));
  CHECK(height_m.value_or(0.0) == Approx(0.0).margin(0.15));
}

TEST_CASE("a ground without texture or without speckle or of few views tells no height") {
  CHECK_FALSE(ground_height_m(featureless_scene(24), box_from(1.0)));
  CHECK_FALSE(ground_height_m(ground_scene(24, [](int) { return 1.0; }), box_from(1.0)));
  CHECK_FALSE(ground_height_m(speckled_scene(5, 1.0), box_from(1.0)));
}

TEST_CASE("a ground further away than heights are tried tells none") {
  CHECK_FALSE(ground_height_m(speckled_scene(36, 1.0), box_from(4.5)));
}

TEST_CASE("a height that is told is taken in world coordinates") {
  auto images = speckled_scene(12, 1.0);
  for (PosedImage& image : images) image.acquisition.aim_m = {3.0, 10.0, 0.0};
  Box box = ground_scene_box();
  box.min += glm::dvec3(3.0, 10.0, 0.0);
  box.max += glm::dvec3(3.0, 10.0, 0.0);
  CHECK(training_set(images, box, {.ground_m = 9.5, .above_ground_m = {}}).box_m.min.y == -0.5);
  CHECK_THROWS_AS(training_set(images, box, {.ground_m = 18.0, .above_ground_m = {}}), UsageError);
}
