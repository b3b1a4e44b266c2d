// SPDX-License-Identifier: Apache-2.0
// A level ground in the images: found, carved by, and looked at only where something stands on it.
#include "sarnerf/nerf/bare_ground.h"

#include "grid_learning.h"
#include "ground_scene.h"
#include "sarnerf/nerf/carving.h"
#include "standing_view.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

/// How far around the block the images leave open what is there: their pixels, and those next to it.
constexpr double kHull_m = 2.5;

bool inside(const Box& box, const glm::dvec3& p, double margin_m) {
  return glm::all(glm::greaterThan(p, box.min - margin_m)) && glm::all(glm::lessThan(p, box.max + margin_m));
}

}  // namespace

TEST_CASE("the texture and the gains of a level ground are found, and the pixels that show nothing else") {
  const auto gain = [](int v) { return v % 2 == 0 ? 1.0 : 1.7; };
  const std::vector<PosedImage> images = ground_scene(16, gain);
  const auto ground = find_bare_ground(images, ground_scene_box());
  REQUIRE(ground);
  CHECK(ground->deviation < 0.02);
  CHECK(ground->gain[1] / ground->gain[0] == Approx(1.7).epsilon(0.01));
  // Values between pixels, 0.57 m of ground long, are linear.
  for (const glm::dvec2& p : {glm::dvec2(5.0, 4.0), glm::dvec2(-7.3, 1.2), glm::dvec2(3.1, -6.4)})
    CHECK(ground->gain[0] * ground->texture_at(p.x, p.y) == Approx(ground_scene_texture(p.x, p.y)).epsilon(0.02));
  std::size_t n_bare = 0, n_ground = 0;
  for (std::size_t v = 0; v < images.size(); ++v) {
    for (int i = 0; i < images[v].power.n_azimuth(); ++i) {
      for (int j = 0; j < images[v].power.n_range(); ++j) {
        const float power = images[v].power(i, j);
        const bool other = power == 0.0f || power == 2.0f;
        if (other) CHECK(ground->bare[v](i, j) == 0);
        n_ground += other ? 0 : 1;
        n_bare += ground->bare[v](i, j);
      }
    }
  }
  CHECK(static_cast<double>(n_bare) > 0.98 * static_cast<double>(n_ground));
}

TEST_CASE("no ground is found in speckle or without a background or in few views") {
  const auto unit = [](int) { return 1.0; };
  std::vector<PosedImage> images = ground_scene(12, unit);
  REQUIRE(find_bare_ground(images, ground_scene_box()));
  CHECK_FALSE(find_bare_ground(std::span(images).first(5), ground_scene_box()));
  std::vector<PosedImage> dark = images, speckled = images;
  std::mt19937 random(3);
  std::exponential_distribution<float> speckle(1.0f);
  for (std::size_t v = 0; v < images.size(); ++v) {
    for (float& p : dark[v].power.pixels()) p = p == 2.0f ? p : 0.0f;
    for (float& p : speckled[v].power.pixels()) p *= speckle(random);
  }
  CHECK_FALSE(find_bare_ground(dark, ground_scene_box()));
  CHECK_FALSE(find_bare_ground(speckled, ground_scene_box()));
}

TEST_CASE("bare ground carves all space but what stands on it and the ground itself") {
  const TrainingSet set = ground_scene_set(16);
  const GridTransform transform = grid_transform(set, 0.4);
  const CarvedVoxels carved = carve(set, transform);
  const Box& block = ground_scene_block();
  std::size_t n_above = 0, n_block = 0, n_far = 0;
  for (std::uint32_t v = 0; v < carved.active.size(); ++v) {
    const glm::ivec3 voxel = carved.topology.coordinate(v / kBrickVoxels) * kBrickSide + voxel_in_brick(v);
    const glm::dvec3 p = transform.world_from_index(glm::dvec3(voxel));
    const bool active = carved.active[v] != 0;
    if (inside(block, p, -0.2)) CHECK(active);
    if (!active || p.y < 0.0) continue;
    ++n_above;
    n_block += inside(block, p, 0.2) ? 1 : 0;
    n_far += inside(block, p, kHull_m) ? 0 : 1;
  }
  CHECK(n_far == 0);
  CHECK(n_above < 4 * n_block);
}

TEST_CASE("rays of what stands on the ground make all of its bins") {
  const TrainingSet set = ground_scene_set(16);
  GridOptions options;
  options.voxel_size_m = 0.4;
  options.n_levels = 1;
  const GridField field = initial_grid_field(set, options);
  const Box standing_m = field.standing_box_m(0.0);
  constexpr double kBrick_m = kBrickSide * 0.4;
  CHECK(inside(ground_scene_block(), standing_m.min, kHull_m + kBrick_m));
  CHECK(inside(ground_scene_block(), standing_m.max, kHull_m + kBrick_m));
  RaySampling sampling;
  sampling.ray_spacing_m = 0.3;
  sampling.longest_m = 0.4;
  const torch::NoGradGuard no_grad;
  for (const PosedImage& image : {set.images[0], set.images[3]}) {
    const StandingView part = standing_view(image.acquisition, standing_m, 0.0);
    REQUIRE(part.first_bin > 0);
    REQUIRE(part.end_bin < image.power.n_range());
    RowRequest all{image.acquisition, 24}, some = all;
    some.least_angle_rad = part.least_angle_rad;
    some.most_angle_rad = part.most_angle_rad;
    const torch::Tensor whole = field.render_rows({{all}}, sampling), limited = field.render_rows({{some}}, sampling);
    const auto difference = (whole - limited).abs();
    CHECK(difference.slice(0, part.first_bin, part.end_bin).max().item<float>() < 1e-6f);
    CHECK(difference.max().item<float>() > 1e-3f);  // the rest is left out
    for (int j = 0; j < image.power.n_range(); ++j) {
      const float power = image.power(24, j);
      if (power == 0.0f || power == 2.0f) CHECK((j >= part.first_bin && j < part.end_bin));
    }
  }
}
