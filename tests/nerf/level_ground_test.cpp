// SPDX-License-Identifier: Apache-2.0
// Rays that end on a level ground: closed forms, central differences, and how the ground is found under speckle.
#include "sarnerf/nerf/ground.h"

#include <algorithm>
#include <numeric>

#include "ground_scene.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/occupancy_grid.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/trainer.h"
#include "small_grid.h"
#include "small_set.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

std::shared_ptr<const LevelGround> uniform_ground(double height_m, double power, double noise = 0.0) {
  auto ground = std::make_shared<LevelGround>();
  ground->noise = noise;
  ground->height_m = height_m;
  ground->texture = Image<float>(3, 3, static_cast<float>(power));
  ground->first_x_m = ground->first_z_m = -1.0;
  ground->incidence_rad = {0.5, 1.0};
  ground->gain = {1.0, 3.0};
  return ground;
}

double total(const torch::Tensor& pixels) { return pixels.to(torch::kDouble).sum().item<double>(); }

}  // namespace

TEST_CASE("the backscatter of a ground is linear between its pitches and constant beyond") {
  const auto ground = uniform_ground(0.0, 1.0);
  const double low = ground->incidence_rad.front(), high = ground->incidence_rad.back();
  CHECK(ground->gain_at(low) == 1.0);
  CHECK(ground->gain_at(high) == 3.0);
  const auto gamma = [&](double incidence_rad) { return ground->gain_at(incidence_rad) * std::tan(incidence_rad); };
  CHECK(gamma(0.2) == Approx(1.0 * std::tan(low)));
  CHECK(gamma(0.5 * (low + high)) == Approx(0.5 * (1.0 * std::tan(low) + 3.0 * std::tan(high))));
  CHECK(gamma(1.4) == Approx(3.0 * std::tan(high)));
  CHECK(ground->texture_at(50.0, -50.0) == 1.0);
}

TEST_CASE("without matter a row is the ground's image and with opaque matter its shadow is black, or noise") {
  const double noise = GENERATE(0.0, 0.03, 1.0);  // the last is more than the ground returns
  GridField field = small_grid(21);
  field.ground = uniform_ground(-2.0, 0.1, noise);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  const torch::NoGradGuard no_grad;
  const double gain = field.ground->gain_at(rows[0].acquisition.incidence_rad);

  field.log_depth.fill_(-30.0f);
  const torch::Tensor bare = field.render_rows(rows, sampling);
  CHECK(bare.min().item<float>() == Approx(0.1 * gain).epsilon(1e-5));
  CHECK(bare.max().item<float>() == Approx(0.1 * gain).epsilon(1e-5));

  field.log_depth.fill_(10.0f);
  field.coefficients.zero_();
  const torch::Tensor shaded = field.render_rows(rows, sampling);
  CHECK(shaded.min().item<float>() == Approx(std::min(noise, 0.1 * gain)).epsilon(1e-4).margin(1e-6));
  CHECK(shaded.max().item<float>() == Approx(0.1 * gain).epsilon(1e-5));
}

TEST_CASE("a slab of fog lets the square of its transmittance of the ground through") {
  // The ball is replaced by its own densities; what a pixel of the ground loses is what rays lose, at all depths.
  GridField field = small_grid(22);
  field.ground = uniform_ground(-2.0, 1.0);
  const auto rows = some_rows();
  RaySampling sampling = small_sampling();
  sampling.end_depth = 1e30;
  const torch::NoGradGuard no_grad;
  field.coefficients.zero_();
  field.log_depth.fill_(std::log(0.05f));
  const torch::Tensor thin = field.render_rows(rows, sampling);
  field.log_depth.fill_(std::log(0.1f));
  const torch::Tensor thick = field.render_rows(rows, sampling);
  const double gain = field.ground->gain_at(rows[0].acquisition.incidence_rad);
  // Of one ray alone, S(2κ) = S(κ)²; where a pixel has several, the mean of squares is larger by their variance.
  const torch::Tensor s = thin / gain, s2 = thick / gain;
  CHECK((s2 - s * s).min().item<float>() > -1e-5f);
  CHECK((s2 - s * s).max().item<float>() < 0.02f);
  // Along the longest path through the fog, both ways; one way alone would leave 0.83.
  CHECK(s.min().item<float>() < 0.76f);
  CHECK(s.min().item<float>() > 0.6f);
}

TEST_CASE("gradients through the ground agree with central differences") {
  GridField field = small_grid(23);
  field.ground = uniform_ground(-2.0, 0.5, 0.2);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  field.render_rows(rows, sampling).sum().backward();
  const torch::Tensor gradient = field.log_depth.grad().clone(), direction = gradient / gradient.norm();
  const torch::NoGradGuard no_grad;
  constexpr float kStep = 0.02f;
  field.log_depth.add_(direction, kStep);
  const double above = total(field.render_rows(rows, sampling));
  field.log_depth.sub_(direction, 2.0 * kStep);
  const double below = total(field.render_rows(rows, sampling));
  CHECK((above - below) / (2.0 * double{kStep}) == Approx(gradient.norm().item<double>()).epsilon(3e-3));
}

TEST_CASE("a ground comes back from a model's archive") {
  GridField field = small_grid(24);
  field.ground = uniform_ground(-2.0, 0.5, 0.1);
  const GridField again = restore_grid_field(field.state(), "test");
  REQUIRE(again.ground != nullptr);
  CHECK(again.ground->height_m == -2.0);
  CHECK(again.ground->gain == field.ground->gain);
  CHECK(again.ground->noise == 0.1);
  CHECK(total(again.render_rows(some_rows(), small_sampling())) == total(field.render_rows(some_rows(), small_sampling())));
  Archive damaged = field.state();
  damaged.tensors["ground_texture"] = torch::full({2, 2}, NAN);
  CHECK_THROWS_AS(restore_grid_field(damaged, "test"), CheckpointError);
}

TEST_CASE("of chips of one object what is bright or dark away from it is ground") {
  // Two views, which cannot outvote a patch: one as bright as the block, one dark.
  std::vector<PosedImage> images = speckled_scene(2, 4.0);
  const auto fill = [&](std::size_t v, int i0, int j0, float power) {
    for (int i = i0; i < i0 + 6; ++i)
      for (int j = j0; j < j0 + 6; ++j) images[v].power(i, j) = power;
  };
  fill(0, 3, 4, 2.0f);
  fill(1, 40, 54, 0.0f);
  GroundRule rule;
  rule.least_views = 2;
  const auto learned = [&](int reach_pixels) {
    rule.object_reach_pixels = reach_pixels;
    return training_set(images, ground_scene_box(), {.ground_m = 0.0, .above_ground_m = {}}, {}, rule);
  };
  const auto n_voxels = [](const TrainingSet& set) {
    const CarvedVoxels voxels = carve(set, grid_transform(set, 0.5));
    return std::count(voxels.active.begin(), voxels.active.end(), 1);
  };
  const TrainingSet any = learned(0), one = learned(8);
  REQUIRE((any.ground && one.ground));
  CHECK(any.ground->mask[0](6, 7) == 0);
  CHECK(any.ground->mask[1](43, 57) == 0);
  CHECK(one.ground->mask[0](6, 7) == 1);
  CHECK(one.ground->mask[1](43, 57) == 1);
  // The block and its shadow stay.
  const Acquisition& a = images[0].acquisition;
  const RadarPoint top = project(a, radar_frame(a), {0.0, 3.0, 0.0});
  CHECK(one.ground->mask[0](static_cast<int>(a.row_of(top.along_track_m)), static_cast<int>(a.bin_of(top.range_offset_m))) == 0);
  CHECK(n_voxels(one) < n_voxels(any));
  CHECK(static_cast<double>(n_voxels(one)) > 4 * 3 * 3 / 0.125);
}

TEST_CASE("the ground under speckle has the mean of its clean image") {
  const std::vector<PosedImage> images = speckled_scene(36, 1.0);
  const std::optional<GroundEstimate> found = estimate_ground(images, ground_scene_box());
  REQUIRE(found.has_value());
  double error = 0.0;
  int n = 0;
  for (double x = -8.0; x <= 8.0; x += 1.0)
    for (double z = -8.0; z <= 8.0; z += 1.0) {
      if (std::abs(x) < 6.0 && std::abs(z) < 6.0) continue;  // the block, its layover and its shadow
      const double power = found->plane->texture_at(x, z) * found->plane->gain[0];
      error += std::abs(power / ground_scene_texture(x, z) - 1.0);
      ++n;
    }
  // Texture varies by 30 % and single pixels by 100 %.
  CHECK(error / n < 0.1);
}

TEST_CASE("the noise of speckled images is what returns from their shadows") {
  const auto noise_of_scene = [](double noise, int side) {
    auto images = ground_scene(36, [](int) { return 1.0; });
    for (PosedImage& image : images) {
      for (int i = 4; i < 4 + side; ++i)
        for (int j = 44; j < 44 + side; ++j) image.power(i, j) = 0.0f;
      for (float& p : image.power.pixels()) p += static_cast<float>(noise);
    }
    add_speckle(images, 1.0);
    const std::optional<GroundEstimate> found = estimate_ground(images, ground_scene_box());
    REQUIRE(found.has_value());
    return found->plane->noise;
  };
  // Some 70 pixels of one look in each of 36 views: a standard deviation of 2 %.
  CHECK(noise_of_scene(0.01, 16) == Approx(0.01).epsilon(0.06));
  CHECK(noise_of_scene(0.002, 16) == Approx(0.002).epsilon(0.06));
  CHECK(noise_of_scene(0.0, 16) == 0.0);
  CHECK(noise_of_scene(0.01, 4) == 0.0);  // too small to have a core, as the shadow of the block is
}

TEST_CASE("bright thirds of half of the views do not change the ground's power") {
  std::vector<PosedImage> images = speckled_scene(36, 1.0);
  const double before = estimate_ground(images, ground_scene_box())->plane->mean_power();
  // Over the far third of every other view: a median over all pixels is 1.8 times as large there.
  for (std::size_t v = 0; v < images.size(); v += 2) {
    Image<float>& power = images[v].power;
    for (int i = 0; i < power.n_azimuth(); ++i)
      for (int j = 2 * power.n_range() / 3; j < power.n_range(); ++j) power(i, j) *= 30.0f;
  }
  const std::optional<GroundEstimate> found = estimate_ground(images, ground_scene_box());
  REQUIRE(found.has_value());
  // A sixth of all blocks is bright: the median of block means becomes the 60 % quantile of the others', which scatter by 30 %.
  CHECK(found->plane->mean_power() == Approx(before).epsilon(0.15));
}

TEST_CASE("speckled clutter carves what stands nowhere and leaves what does") {
  TrainingSet set = training_set(speckled_scene(36, 1.0), ground_scene_box(), {.ground_m = 0.0, .above_ground_m = 6.0});
  REQUIRE(set.ground.has_value());
  CHECK(set.ground->speckled);
  CHECK(set.box_m.max.y == 6.0);
  const CarvedVoxels carved = carve(set, grid_transform(set, 0.5));
  const auto n = std::accumulate(carved.active.begin(), carved.active.end(), std::size_t{0});
  // The block has 288 voxels of half a metre, the box 62,000.
  CHECK(n >= 288);
  CHECK(n < 6000);
}

TEST_CASE("what neither shines nor casts a shadow within the image is carved") {
  Box box = ground_scene_box();
  box.max.y = 30.0;
  const TrainingSet set = training_set(speckled_scene(36, 1.0), box, {.ground_m = 0.0, .above_ground_m = 30.0});
  const GridTransform transform = grid_transform(set, 1.0);
  const CarvedVoxels carved = carve(set, transform);
  // High above the block: places that views see, and whose shadows most of them do not.
  std::size_t n = 0;
  for (std::size_t v = 0; v < carved.active.size(); ++v) {
    if (carved.active[v] == 0) continue;
    const glm::ivec3 voxel = carved.topology.voxel(v);
    const glm::dvec3 point_m = transform.world_from_index(glm::dvec3(voxel));
    if (point_m.y > 12.0 && std::abs(point_m.x) < 10.0 && std::abs(point_m.z) < 10.0) ++n;
  }
  CHECK(n == 0);
}
