// SPDX-License-Identifier: Apache-2.0
// A level ground in images without speckle: found, carved by, and looked at only where something stands on it.
#include "train/grid_learner.h"
#include "ground_scene.h"
#include "sarnerf/nerf/occupancy_grid.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/ground.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

/// How far around the block the images leave open what is there: pixels whose surroundings do not look like ground.
constexpr double kHull_m = 3.5;

bool inside(const Box& box, const glm::dvec3& p, double margin_m) {
  return glm::all(glm::greaterThan(p, box.min - margin_m)) && glm::all(glm::lessThan(p, box.max + margin_m));
}

}  // namespace

TEST_CASE("the texture of a clean ground is found and the pixels that look like it") {
  const std::vector<PosedImage> images = ground_scene(16, [](int) { return 1.0; });
  const auto found = estimate_ground(images, ground_scene_box());
  REQUIRE(found);
  CHECK_FALSE(found->speckled);
  // Cells take the nearest pixel: half of one is up to 5 % of this texture.
  CHECK(found->deviation < 0.03);
  const double gain_of_ground = found->plane->gain_at(images[0].acquisition.incidence_rad);
  for (const glm::dvec2& p : {glm::dvec2(5.0, 4.0), glm::dvec2(-7.3, 1.2), glm::dvec2(3.1, -6.4)})
    CHECK(gain_of_ground * found->plane->texture_at(p.x, p.y) == Approx(ground_scene_texture(p.x, p.y)).epsilon(0.05));
  std::size_t n_like = 0, n_ground = 0;
  for (std::size_t v = 0; v < images.size(); ++v) {
    const auto power = images[v].power.pixels();
    for (std::size_t n = 0; n < power.size(); ++n) {
      if (power[n] == 2.0f) CHECK(found->mask[v].pixels()[n] == 0);
      n_ground += power[n] != 0.0f && power[n] != 2.0f ? 1 : 0;
      n_like += found->mask[v].pixels()[n];
    }
  }
  // The borders of what shines and of shadows count to those.
  CHECK(static_cast<double>(n_like) > 0.85 * static_cast<double>(n_ground));
  CHECK(n_like < n_ground);
}

TEST_CASE("no ground is found without a background or in few views or in relief") {
  std::vector<PosedImage> images = ground_scene(12, [](int) { return 1.0; });
  REQUIRE(estimate_ground(images, ground_scene_box()));
  CHECK_FALSE(estimate_ground(std::span(images).first(5), ground_scene_box()));
  std::vector<PosedImage> dark = images, relief = images;
  for (std::size_t v = 0; v < images.size(); ++v) {
    for (float& p : dark[v].power.pixels()) p = p == 2.0f ? p : 0.0f;
    // Slopes that turn with the view, smooth from pixel to pixel.
    for (int i = 0; i < relief[v].power.n_azimuth(); ++i)
      for (int j = 0; j < relief[v].power.n_range(); ++j)
        relief[v].power(i, j) *= static_cast<float>(std::exp(std::sin(0.12 * i + double(v)) + std::sin(0.1 * j - 2.0 * double(v))));
  }
  CHECK_FALSE(estimate_ground(dark, ground_scene_box()));
  CHECK_FALSE(estimate_ground(relief, ground_scene_box()));
}

TEST_CASE("clean ground carves all space but what stands on it") {
  const TrainingSet set = ground_scene_set(16);
  CHECK(set.box_m.max.y == ground_scene_box().max.y);
  const GridTransform transform = grid_transform(set, 0.4);
  const CarvedVoxels carved = carve(set, transform);
  const Box& block = ground_scene_block();
  std::size_t n_active = 0, n_block = 0, n_far = 0;
  for (std::uint32_t v = 0; v < carved.active.size(); ++v) {
    const glm::ivec3 voxel = carved.topology.voxel(v);
    const glm::dvec3 p = transform.world_from_index(glm::dvec3(voxel));
    const bool active = carved.active[v] != 0;
    if (inside(block, p, -0.2)) CHECK(active);
    if (!active) continue;
    CHECK(p.y > 0.0);
    ++n_active;
    n_block += inside(block, p, 0.2) ? 1 : 0;
    n_far += inside(block, p, kHull_m) ? 0 : 1;
  }
  CHECK(n_far == 0);
  CHECK(n_active < 6 * n_block);
}

TEST_CASE("rays of what stands on the ground make all of its bins") {
  const TrainingSet set = ground_scene_set(16);
  GridOptions options;
  options.voxel_size_m = 0.4;
  options.n_levels = 1;
  const GridField field = initial_grid_field(set, options);
  const Box standing_m = field.occupied_box_m();
  RaySampling sampling;
  sampling.ray_spacing_m = 0.3;
  sampling.longest_m = 0.4;
  const torch::NoGradGuard no_grad;
  for (const PosedImage& image : {set.images[0], set.images[3]}) {
    const LayoverShadowWindow part = layover_shadow_window(image.acquisition, standing_m, 0.0);
    REQUIRE(part.first_bin > 0);
    REQUIRE(part.end_bin < image.power.n_range());
    RowRequest all{image.acquisition, 24}, some = all;
    some.least_angle_rad = part.least_angle_rad;
    some.most_angle_rad = part.most_angle_rad;
    const torch::Tensor whole = field.render_rows({{all}}, sampling), limited = field.render_rows({{some}}, sampling);
    CHECK((whole - limited).abs().slice(0, part.first_bin, part.end_bin).max().item<float>() < 1e-6f);
    for (int j = 0; j < image.power.n_range(); ++j) {
      const float power = image.power(24, j);
      if (power == 0.0f || power == 2.0f) CHECK((j >= part.first_bin && j < part.end_bin));
    }
  }
}
