// SPDX-License-Identifier: Apache-2.0
// The height of a ground whose texture speckled views have in common.
#include "sarnerf/nerf/ground.h"

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

TEST_CASE("the height of a ground is estimated from its texture under speckle") {
  const auto images = speckled_scene(36, 1.0);
  // A pixel of slant range is 0.57 m of height here.
  for (const double bottom_m : {1.3, -1.1, 0.0}) {
    const auto ground = estimate_ground(images, box_from(bottom_m));
    REQUIRE(ground.has_value());
    CHECK(ground->plane->height_m == Approx(0.0).margin(0.15));
    CHECK(training_set(images, box_from(bottom_m)).box_m.min.y == ground->plane->height_m);
  }
}

TEST_CASE("several scenes of a few views show the height of their ground together") {
  // Six scenes of six views each: every sixth of 36, beginning with another one. The speckle of all of them is independent.
  const auto images = speckled_scene(36, 1.0);
  std::vector<std::vector<PosedImage>> scenes(6);
  for (std::size_t v = 0; v < images.size(); ++v) scenes[v % 6].push_back(images[v]);
  const auto height_m = common_ground_height_m(scenes, box_from(1.3));
  REQUIRE(height_m.has_value());
  CHECK(*height_m == Approx(0.0).margin(0.3));
  // A box that happens to stand near the ground proves nothing against it.
  const auto again_m = common_ground_height_m(scenes, box_from(0.1));
  REQUIRE(again_m.has_value());
  CHECK(*again_m == Approx(0.0).margin(0.3));
  scenes = {featureless_scene(6), featureless_scene(6)};
  CHECK(!common_ground_height_m(scenes, box_from(1.3)));
  scenes = {{images.front()}, {images.back()}};
  CHECK(!common_ground_height_m(scenes, box_from(1.3)));
}

TEST_CASE("without texture or without speckle the ground is the bottom of the box") {
  const auto height_m = [](const std::vector<PosedImage>& images) {
    const auto ground = estimate_ground(images, box_from(1.0));
    REQUIRE(ground.has_value());
    return ground->plane->height_m;
  };
  CHECK(height_m(featureless_scene(24)) == 1.0);
  CHECK(height_m(ground_scene(24, [](int) { return 1.0; })) == 1.0);
}

TEST_CASE("what views agree on in one place only is no texture of a ground") {
  // A dim plate, 1.5 m above a ground without texture: as bright as the ground, so that masks do not exclude it.
  auto images = featureless_scene(36);
  for (PosedImage& image : images) {
    const RadarFrame frame = radar_frame(image.acquisition);
    const std::vector<double> offset_m = plane_offsets_m(image.acquisition, 1.5);
    for (int i = 0; i < image.power.n_azimuth(); ++i)
      for (int j = 0; j < image.power.n_range(); ++j) {
        const glm::dvec3 p = image.acquisition.row_offset_m(i) * frame.h +
                             offset_m[static_cast<std::size_t>(j)] * level_range_direction(image.acquisition);
        if (std::abs(p.x) < 2.0 && std::abs(p.z) < 2.0) image.power(i, j) *= 1.5f;
      }
  }
  const auto ground = estimate_ground(images, box_from(0.0));
  REQUIRE(ground.has_value());
  CHECK(ground->plane->height_m == 0.0);
}

TEST_CASE("a ground farther away than heights are tried stays at the bottom of the box") {
  const auto ground = estimate_ground(speckled_scene(36, 1.0), box_from(4.5));
  REQUIRE(ground.has_value());
  CHECK(ground->plane->height_m == 4.5);
}

TEST_CASE("a height that is given is not estimated") {
  const auto ground = estimate_ground(speckled_scene(36, 1.0), box_from(0.0), 0.4);
  REQUIRE(ground.has_value());
  CHECK(ground->plane->height_m == 0.4);
}

TEST_CASE("a height that is given is taken in world coordinates") {
  auto images = speckled_scene(12, 1.0);
  for (PosedImage& image : images) image.acquisition.aim_m = {3.0, 10.0, 0.0};
  Box box = ground_scene_box();
  box.min += glm::dvec3(3.0, 10.0, 0.0);
  box.max += glm::dvec3(3.0, 10.0, 0.0);
  CHECK(training_set(images, box, {.ground_m = 9.5, .above_ground_m = {}}).box_m.min.y == -0.5);
  CHECK_THROWS_AS(training_set(images, box, {.ground_m = 18.0, .above_ground_m = {}}), UsageError);
}
