// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/trainer.h"

#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "small_set.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

constexpr int kSteps = 60;

double train(Trainer& trainer, int from, int to) {
  double loss = 0.0;
  for (int n = from; n < to; ++n) loss = trainer.step(double(n) / kSteps).loss;
  return loss;
}

/// A set whose images have been changed by `change`.
template <class Change>
TrainingSet changed_set(int n_views, Change&& change) {
  TrainingSet set = small_set(n_views);
  for (PosedImage& image : set.images) change(image);
  return set;
}

}  // namespace

TEST_CASE("training brings the images closer") {
  const TrainingSet set = small_set(8);
  Trainer trainer(set, small_options(set));
  const double first = trainer.step(0.0).loss;
  const double last = train(trainer, 1, kSteps);
  CHECK(trainer.steps_done() == kSteps);
  CHECK(last < 0.05 * first);
}

TEST_CASE("a trial chooses the field that predicts views best, and needs six of them") {
  const FieldChoice none = choose_field(small_set(5));
  CHECK(none.field == "surface");
  CHECK(none.trials.empty());
  CHECK(choice_text(none).find("too few") != std::string::npos);

  const TrainingSet set = small_set(8);
  TrialRule rule;
  rule.n_steps = 20;
  const FieldChoice choice = choose_field(set, 1, {}, rule);
  REQUIRE(choice.trials.size() == 2);
  CHECK(choice.held_out == spread_indices(8, 3));
  const FieldTrial &a = choice.trials[0], &b = choice.trials[1];
  CHECK(a.n_steps == 20);
  CHECK(choice.field == (a.psnr_power_db >= b.psnr_power_db ? a.field : b.field));
}

TEST_CASE("the same seed gives the same bits, another one others") {
  const TrainingSet set = small_set(6);
  TrainerOptions options = small_options(set);
  Trainer a(set, options), b(set, options);
  train(a, 0, 20);
  train(b, 0, 20);
  CHECK(same_bits(a.checkpoint(), b.checkpoint()));
  options.seed = 2;
  Trainer c(set, options);
  train(c, 0, 20);
  CHECK_FALSE(torch::equal(a.checkpoint().tensors.at("log_depth"), c.checkpoint().tensors.at("log_depth")));
}

TEST_CASE("a resumed training equals an uninterrupted one bit for bit") {
  const ThreadLimit one_thread(1);
  TrainingSet set = small_set(6);
  set.exact_poses = GENERATE(true, false);
  const TrainerOptions options = small_options(set);
  Trainer whole(set, options);
  train(whole, 0, kSteps);
  // Before the first step, before and after a refinement, and in between prunings.
  for (const int cut : {0, 7, 14, 16, 41}) {
    Trainer first(set, options);
    train(first, 0, cut);
    const Archive saved = first.checkpoint();
    Trainer second(set, options);
    second.restore(saved, "checkpoint");
    REQUIRE(same_bits(second.checkpoint(), saved));
    train(second, cut, kSteps);
    CHECK(same_bits(second.checkpoint(), whole.checkpoint()));
  }
}

TEST_CASE("voxels are halved once there were enough steps and enough are to come") {
  const TrainingSet set = small_set(6);
  const TrainerOptions options = small_options(set);
  const double fine_m = options.grid.voxel_size_m;
  const auto voxel_size_m = [&](int n_steps, double first_progress) {
    Trainer trainer(set, options);
    for (int n = 0; n < n_steps; ++n) trainer.step(first_progress + (1.0 - first_progress) * n / n_steps);
    return trainer.field().voxel_size_m();
  };
  CHECK(voxel_size_m(40, 0.0) == fine_m);
  // At the fifth step of 14, nine are to come.
  CHECK(voxel_size_m(14, 0.0) == 2.0 * fine_m);
  CHECK(voxel_size_m(16, 0.0) == fine_m);
  // A schedule that begins behind the halving's place still waits for its steps, at most until too few are left.
  CHECK(voxel_size_m(20, 0.5) == fine_m);
  CHECK(voxel_size_m(1, 0.9) == 2.0 * fine_m);
}

TEST_CASE("voxels are given up no sooner than all rows were learned from") {
  const TrainingSet set = small_set(6);
  TrainerOptions options = small_options(set);
  options.grid.n_levels = 1;
  options.grid.n_prunings = 10 * kSteps;
  const auto first_pruning = [&](int rows_per_step) {
    options.rows_per_step = rows_per_step;
    Trainer trainer(set, options);
    const auto none_yet = [&] { return trainer.checkpoint().json.find("\"prunings\":0") != std::string::npos; };
    int n = 0;
    for (; n < kSteps && none_yet(); ++n) trainer.step(double(n) / kSteps);
    return n;
  };
  // The last call, of step n, prunes before it learns: n − 1 steps were done. Six views have 8 rows each that see the box.
  CHECK(first_pruning(12) - 1 == 4);
  CHECK(first_pruning(24) - 1 == 2);
}

TEST_CASE("a checkpoint of other options is refused") {
  const TrainingSet set = small_set(3);
  TrainerOptions options = small_options(set);
  Trainer trainer(set, options);
  train(trainer, 0, 2);
  const Archive saved = trainer.checkpoint();
  options.rows_per_step = 5;
  Trainer other(set, options);
  CHECK_THROWS_AS(other.restore(saved, "checkpoint"), CheckpointError);
}

TEST_CASE("sets at the edge are learned without harm") {
  SECTION("one view") {
    const TrainingSet set = small_set(1);
    Trainer trainer(set, small_options(set));
    CHECK(std::isfinite(train(trainer, 0, kSteps)));
  }
  SECTION("one pixel") {
    TrainingSet set = small_set(1);
    PosedImage& image = set.images.front();
    image.acquisition.n_azimuth = image.acquisition.n_range = 1;
    image.power = Image<float>(1, 1, set.peak);
    Trainer trainer(set, small_options(set));
    CHECK(std::isfinite(train(trainer, 0, kSteps)));
  }
  SECTION("a dynamic range of 1e8") {
    const TrainingSet set = changed_set(4, [](PosedImage& image) {
      int n = 0;
      for (float& p : image.power.pixels()) p *= n++ % 2 == 0 ? 1.0f : 1e-8f;
    });
    Trainer trainer(set, small_options(set));
    CHECK(std::isfinite(train(trainer, 0, kSteps)));
  }
  SECTION("views that contradict each other end between them") {
    TrainingSet set = small_set(2);
    set.images[1] = set.images[0];
    for (float& p : set.images[1].power.pixels()) p *= 3.0f;
    set.peak *= 3.0f;
    Trainer trainer(set, small_options(set));
    train(trainer, 0, kSteps);
    const Image<float> learned = render_view(trainer.field(), set.images[0].acquisition);
    double sum = 0.0, first = 0.0;
    for (std::size_t n = 0; n < learned.pixels().size(); ++n) {
      sum += double{learned.pixels()[n]};
      first += double{set.images[0].power.pixels()[n]};
    }
    CHECK(sum > 1.5 * first);
    CHECK(sum < 2.5 * first);
  }
  SECTION("unequal sizes of images") {
    TrainingSet set = small_set(4);
    PosedImage& image = set.images[1];
    Acquisition& a = image.acquisition;
    Image<float> cut(a.n_azimuth - 2, a.n_range - 4);
    for (int i = 0; i < cut.n_azimuth(); ++i)
      for (int j = 0; j < cut.n_range(); ++j) cut(i, j) = image.power(i + 1, j + 2);
    image.power = cut;
    a.n_azimuth -= 2;
    a.n_range -= 4;
    Trainer trainer(set, small_options(set));
    const double first = trainer.step(0.0).loss;
    CHECK(train(trainer, 1, kSteps) < 0.05 * first);
  }
  SECTION("opaque and nearly empty beginnings") {
    const TrainingSet set = small_set(6);
    for (const double depth : {30.0, 0.03}) {
      TrainerOptions options = small_options(set);
      options.grid.initial_depth = depth;
      Trainer trainer(set, options);
      const double first = trainer.step(0.0).loss;
      CHECK(train(trainer, 1, kSteps) < 0.5 * first);
    }
  }
}

TEST_CASE("many directions call for harmonics of degree 2") {
  const auto options = [](int n_views, double steeper_rad, bool background) {
    TrainingSet set = small_set(n_views);
    set.images.front().acquisition.incidence_rad += steeper_rad;
    set.background = background;
    return default_options(set, "grid").grid;
  };
  CHECK(options(36, 0.1, false).harmonics_degree == 2);
  for (const GridOptions& few : {options(35, 0.1, false), options(36, 0.08, false), options(36, 0.1, true)})
    CHECK(few.harmonics_degree == 1);
}

TEST_CASE("blank images are refused") {
  std::vector<PosedImage> images{{"a", Acquisition{}, Image<float>(4, 4, 0.0f)}};
  CHECK_THROWS_AS(training_set(images, Box{glm::dvec3(-1.0), glm::dvec3(1.0)}), InputError);
  CHECK_THROWS_AS(training_set({}, Box{glm::dvec3(-1.0), glm::dvec3(1.0)}), InputError);
}

TEST_CASE("absurd learning rates are noticed or survived") {
  const TrainingSet set = small_set(4);
  TrainerOptions options = small_options(set);
  options.grid.density_rate = options.grid.source_rate = 1e20;
  Trainer trainer(set, options);
  CHECK_THROWS_AS(train(trainer, 0, kSteps), NumericsError);
}
