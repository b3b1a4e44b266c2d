// SPDX-License-Identifier: Apache-2.0
// Learning with the field `mlp`.
#include <algorithm>
#include <numbers>
#include <utility>
#include <vector>

#include "mlp_cases.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "small_grid.h"
#include "small_mlp.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

constexpr int kNetworkSteps = 400;

/// Loss of the last steps over that of the first.
double learn(Trainer& trainer) {
  double first = 0.0, last = 0.0;
  for (int n = 0; n < kNetworkSteps; ++n) {
    const double loss = trainer.step(double(n) / kNetworkSteps).loss;
    if (n < 20) first += loss;
    if (n >= kNetworkSteps - 20) last += loss;
  }
  return last / first;
}

}  // namespace

TEST_CASE("a small network learns a ball of fog, and its bf16 kernels show the same") {
  const TrainingSet set = small_set();
  Trainer trainer(set, small_mlp_options(set));
  const Acquisition held_out = small_acquisition(0.9);
  const auto kernels_agree = [&] {
    auto field = restore_mlp_field(trainer.field().state(), "memory");
    field.use_kernel(MlpKernel::plain);
    const Image<float> plain = render_view(field, held_out);
    const float peak = *std::max_element(plain.pixels().begin(), plain.pixels().end());
    REQUIRE(peak > 0.01f * set.peak);
    for (const MlpKernel kernel : test::bf16_kernels(field.network().shape)) {
      CAPTURE(name(kernel));
      field.use_kernel(kernel);
      CHECK(psnr_db(render_view(field, held_out), plain, peak) > 45.0);
    }
  };
  kernels_agree();
  CHECK(learn(trainer) < 0.1);
  kernels_agree();
}

TEST_CASE("training of the field mlp goes on from a checkpoint bit by bit") {
  const TrainingSet set = small_set();
  const TrainerOptions options = small_mlp_options(set);
  const auto steps = [](Trainer& trainer, int first, int last) {
    for (int n = first; n < last; ++n) trainer.step(double(n) / 20.0);
  };
  Trainer whole(set, options);
  steps(whole, 0, 7);
  const Archive saved = whole.checkpoint();
  steps(whole, 7, 15);
  Trainer resumed(set, options);
  resumed.restore(saved, "memory");
  CHECK(resumed.steps_done() == 7);
  steps(resumed, 7, 15);
  CHECK(torch::equal(whole.field().parameters()[0], resumed.field().parameters()[0]));
  const Archive one = whole.checkpoint(), two = resumed.checkpoint();
  CHECK(one.json == two.json);
  for (const auto& [name, tensor] : one.tensors) {
    CAPTURE(name);
    CHECK(torch::equal(tensor, two.tensors.at(name)));
  }
  // Before the first step, too.
  Trainer fresh(set, options), again(set, options);
  again.restore(fresh.checkpoint(), "memory");
  steps(fresh, 0, 2);
  steps(again, 0, 2);
  CHECK(torch::equal(fresh.field().parameters()[0], again.field().parameters()[0]));
}

TEST_CASE("the first fog is as bright as fits the images") {
  TrainingSet set = small_set();
  for (const double factor : {1.0, 0.02}) {  // of the images, but not of the scale s
    CAPTURE(factor);
    TrainingSet dimmed = set;
    for (PosedImage& image : dimmed.images)
      for (float& p : image.power.pixels()) p *= static_cast<float>(factor);
    const Trainer trainer(dimmed, small_mlp_options(dimmed));
    double product = 0.0, square = 0.0;
    for (const PosedImage& image : dimmed.images) {
      const Image<float> fog = render_view(trainer.field(), image.acquisition);
      for (std::size_t n = 0; n < fog.pixels().size(); ++n) {
        product += double{fog.pixels()[n]} * double{image.power.pixels()[n]};
        square += double{fog.pixels()[n]} * double{fog.pixels()[n]};
      }
    }
    CHECK(product / square == Approx(1.0).epsilon(0.15));
  }
}

TEST_CASE("views that are far apart see no fine waves of the direction") {
  std::vector<PosedImage> images;
  const auto add = [&](double azimuth_deg, double incidence_deg) {
    PosedImage image;
    image.acquisition = small_acquisition(azimuth_deg * std::numbers::pi / 180.0);
    image.acquisition.incidence_rad = incidence_deg * std::numbers::pi / 180.0;
    images.push_back(image);
  };
  CHECK(suitable_direction_frequencies(images) == 4);
  // Neighbours at 45° differ by 2 sin 45° sin(gap / 2): 1.0, 0.366, 0.185, 0.123, 0.062. Waves of L are 2^(2 − L) long.
  const std::pair<int, int> cases[] = {{4, 0}, {12, 1}, {24, 2}, {36, 3}, {72, 4}, {360, 4}};
  for (const auto& [n, expected] : cases) {
    CAPTURE(n);
    images.clear();
    for (int k = 0; k < n; ++k) add(360.0 * k / n - 90.0, 45.0);
    CHECK(suitable_direction_frequencies(images) == expected);
    const std::size_t n_views = images.size();
    for (std::size_t k = 0; k < n_views; ++k) add(360.0 * static_cast<double>(k) / n - 90.0, 43.0);
    CHECK(suitable_direction_frequencies(images) == expected);  // pitches between do not help
  }
  images.clear();
  for (int k = 0; k < 10; ++k) add(10.0 * k, 45.0);
  CHECK(suitable_direction_frequencies(images) == 3);  // the empty rest of the circle does not count
  images.resize(1);
  CHECK(suitable_direction_frequencies(images) == 0);
}

TEST_CASE("an absurd learning rate of the network is noticed") {
  const TrainingSet set = small_set();
  TrainerOptions options = small_mlp_options(set);
  options.mlp.rate = 100.0;
  Trainer trainer(set, options);
  const auto all = [&] {
    for (int n = 0; n < 200; ++n) trainer.step(0.0);
  };
  CHECK_THROWS_AS(all(), NumericsError);
}

TEST_CASE("options list what concerns the field in use") {
  const TrainingSet set = small_set();
  TrainerOptions options = small_mlp_options(set);
  options.mlp.rate = 0.00123;
  options.mlp.shape.skip = 2;
  const std::string json = options_json(options);
  CHECK(json.find("harmonics_degree") == std::string::npos);
  const TrainerOptions back = options_from_json(json);
  CHECK(back.field == "mlp");
  CHECK(back.mlp.shape == options.mlp.shape);
  CHECK(back.mlp.rate == options.mlp.rate);
  CHECK(options_json(back) == json);
  CHECK_THROWS_AS(options_from_json(R"({"field":"mlp","harmonics_degree":2})"), UsageError);
  CHECK_THROWS_AS(options_from_json(R"({"rate":0.001})"), UsageError);
  CHECK_THROWS_WITH(options_from_json(R"({"speckle_floor":0.5})"), "training option 'speckle_floor' is of an older version: use misfit");
  for (const char* dropped : {R"({"huber_delta":3})", R"({"distortion":0.001})", R"({"smooth_density":0.01})"})
    CHECK_THROWS_WITH(options_from_json(dropped), ContainsSubstring("is of an older version: its rule was dropped, leave it out"));
  options.mlp.initial_depth = 0.0;
  CHECK_THROWS_AS(Trainer(set, options), UsageError);
  options.mlp.initial_depth = 0.2;
  options.mlp.integrator = "nearest";
  CHECK_THROWS_AS(Trainer(set, options), UsageError);
}
