// SPDX-License-Identifier: Apache-2.0
// Learning with the field `surface`, from images by the surface engine, which has no lattice.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "../nerf/small_set.h"
#include "../nerf/torch_catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/surface_field.h"
#include "sarnerf/nerf/trainer.h"
#include "sarnerf/render/engine.h"
#include "solid_meshes.h"
#include "surface_scene.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kRadius_m = 1.6;

/// A ball seen from all around.
std::vector<PosedImage> ball_images(int n_views) {
  const Scene scene = scene_of(sphere_mesh(glm::dvec3(0.0), kRadius_m, 4));
  const SurfaceEngine engine(scene);
  std::vector<PosedImage> images;
  for (int n = 0; n < n_views; ++n) {
    Acquisition a = view_from(2.0 * std::numbers::pi * n / n_views);
    a.n_azimuth = a.n_range = 20;
    Sampling sampling;
    sampling.n_slices = 5;
    images.push_back({"view_" + std::to_string(n), a, engine.render(engine.plan(a, sampling)).beta0});
  }
  return images;
}

TrainingSet set_of(std::vector<PosedImage> images) {
  return training_set(std::move(images), {glm::dvec3(-2.5, -1.7, -2.5), glm::dvec3(2.5, 2.5, 2.5)});
}

TrainerOptions options_of(const TrainingSet& set) {
  TrainerOptions options = default_options(set, "surface");
  options.rows_per_step = 24;
  options.surface.voxel_size_m = 0.2;
  options.surface.redistance_steps = 5;
  return options;
}

double train(Trainer& trainer, int from, int to, int n_steps) {
  double loss = 0.0;
  for (int n = from; n < to; ++n) loss = trainer.step(double(n) / n_steps).loss;
  return loss;
}

/// Heights over the ball's radius above which views from 45° see it.
constexpr double kSeen = -0.5;

/// Volume of the body over that of the ball, and of what only one of both holds, where views see them.
struct Volumes {
  double body = 0.0, different = 0.0;
};

Volumes volumes(const SurfaceField& field) {
  const double height_m = (1.0 - kSeen) * kRadius_m, voxel_m3 = std::pow(field.voxel_size_m(), 3);
  const double ball_m3 = std::numbers::pi * height_m * height_m * (kRadius_m - height_m / 3.0);
  const float* const f = field.distance.data_ptr<float>();
  Volumes v;
  for (std::size_t n = 0; n < field.n_voxels(); ++n) {
    const glm::dvec3 p = field.transform().world_from_index(glm::dvec3(field.topology().voxel(n))) - glm::dvec3(0.013, 0.037, -0.021);
    if (p.y < kSeen * kRadius_m) continue;
    const auto filled = [&](double distance_m) { return std::clamp(0.5 - distance_m / field.voxel_size_m(), 0.0, 1.0); };
    const double here = filled(double{f[n]}), truth = filled(glm::length(p) - kRadius_m);
    v.body += here * voxel_m3 / ball_m3;
    v.different += std::abs(here - truth) * voxel_m3 / ball_m3;
  }
  return v;
}

}  // namespace

TEST_CASE("a ball is learned from its images alone") {
  const TrainingSet set = set_of(ball_images(12));
  Trainer trainer(set, options_of(set));
  const auto& field = dynamic_cast<const SurfaceField&>(trainer.field());
  const Volumes hull = volumes(field);
  constexpr int kSteps = 160;
  const double first = train(trainer, 0, 1, kSteps);
  train(trainer, 1, kSteps, kSteps);
  const Volumes learned = volumes(field);
  CAPTURE(hull.body, hull.different, learned.body, learned.different);
  CHECK(hull.different > 0.5);
  CHECK(learned.different < 0.08);
  CHECK(train(trainer, kSteps - 1, kSteps, kSteps) < 0.02 * first);
}

TEST_CASE("a training of a surface goes on from a checkpoint bit by bit") {
  const ThreadLimit one_thread(1);
  TrainingSet set = set_of(ball_images(6));
  set.exact_poses = GENERATE(true, false);
  const TrainerOptions options = options_of(set);
  constexpr int kSteps = 18;
  Trainer whole(set, options);
  train(whole, 0, kSteps, kSteps);
  // Before the first step, and before and after a redistancing, an update of the occupied space, a halving (at step 6) and the
  // start of the directional brightness (at step 15).
  for (const int cut : {0, 3, 5, 9, 14, 15, 16}) {
    Trainer first(set, options), second(set, options);
    train(first, 0, cut, kSteps);
    const Archive saved = first.checkpoint();
    second.restore(saved, "checkpoint");
    REQUIRE(same_bits(second.checkpoint(), saved));
    train(second, cut, kSteps, kSteps);
    CHECK(same_bits(second.checkpoint(), whole.checkpoint()));
  }
  TrainerOptions other = options;
  other.seed = 2;
  Trainer different(set, other);
  train(different, 0, kSteps, kSteps);
  CHECK_FALSE(torch::equal(different.checkpoint().tensors.at("distance"), whole.checkpoint().tensors.at("distance")));

  Archive damaged = whole.checkpoint();
  damaged.tensors["last_reach"] = damaged.tensors["last_reach"].narrow(0, 0, 7).clone();
  Trainer refusing(set, options);
  CHECK_THROWS_AS(refusing.restore(damaged, "checkpoint"), CheckpointError);
}

TEST_CASE("stiff and hopeless trainings of a surface stay finite or say why they cannot begin") {
  std::vector<PosedImage> images = ball_images(6);
  SECTION("a surface of a ten-thousandth of a metre") {
    const TrainingSet set = set_of(images);
    TrainerOptions options = options_of(set);
    options.surface.initial_softness_bins = 0.3;
    options.surface.final_softness_bins = 1e-4 / kScenePixel_m;
    Trainer trainer(set, options);
    train(trainer, 0, 40, 40);
    CHECK(dynamic_cast<const SurfaceField&>(trainer.field()).sharpness_per_m() == Approx(1e4).epsilon(0.3));
    CHECK(trainer.field().parameters()[0].isfinite().all().item<bool>());
  }
  SECTION("one view") {
    images.resize(1);
    const TrainingSet set = set_of(images);
    Trainer trainer(set, options_of(set));
    CHECK(std::isfinite(train(trainer, 0, 30, 30)));
    CHECK(trainer.field().parameters()[0].isfinite().all().item<bool>());
  }
  SECTION("views that contradict one another") {
    for (std::size_t n = 0; n < images.size(); n += 2) {
      Image<float>& power = images[n].power;
      std::reverse(power.pixels().begin(), power.pixels().end());
    }
    const TrainingSet set = set_of(images);
    Trainer trainer(set, options_of(set));
    CHECK(std::isfinite(train(trainer, 0, 30, 30)));
    for (const torch::Tensor& parameter : trainer.field().parameters()) CHECK(parameter.isfinite().all().item<bool>());
  }
  SECTION("images without returns") {
    for (PosedImage& image : images) std::fill(image.power.pixels().begin(), image.power.pixels().end(), 0.0f);
    CHECK_THROWS_AS(Trainer(set_of(images), options_of(set_of(ball_images(1)))), InputError);
  }
}
