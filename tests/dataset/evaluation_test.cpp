// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/evaluation.h"

#include <atomic>
#include <cmath>
#include <limits>

#include "catch.h"
#include "posed_images.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Spots every 20°, from 5° away; truth in between.
struct Scene {
  std::vector<PosedImage> training, truth;
  std::vector<Image<float>> predictions;

  Scene() {
    const glm::dvec3 world = seen_from(0).aim_m + glm::dvec3(2.0, 1.0, 3.0);
    for (int n = 0; n < 18; ++n) training.push_back(spot(seen_from(20.0 * n), world, 3.0));
    for (int n = 0; n < 7; ++n) {
      truth.push_back(spot(seen_from(50.0 * n + 7.0), world, 3.0));
      truth.back().name = "view" + std::to_string(n);
      predictions.push_back(noise(truth.back().acquisition, 10u + static_cast<unsigned>(n)).power);
      for (std::size_t m = 0; m < predictions.back().pixels().size(); ++m) {
        float& p = predictions.back().pixels()[m];
        p = truth.back().power.pixels()[m] + 0.01f * p;
      }
    }
  }
};

double double_psnr(const Image<float>& a, const Image<float>& b, double peak, bool amplitude) {
  double sum = 0.0;
  for (std::size_t n = 0; n < a.pixels().size(); ++n) {
    const double x = double(a.pixels()[n]), y = double(b.pixels()[n]);
    const double d = amplitude ? std::sqrt(x) - std::sqrt(y) : x - y;
    sum += d * d;
  }
  const double p = amplitude ? std::sqrt(peak) : peak;
  return 10.0 * std::log10(p * p * double(a.pixels().size()) / sum);
}

}  // namespace

TEST_CASE("scores are those of the metrics, relative to the training images' peak") {
  const Scene s;
  const Evaluation e = evaluate(s.truth, s.predictions, s.training);
  double peak = 0.0;
  for (const PosedImage& image : s.training) {
    for (const float p : image.power.pixels()) peak = std::max(peak, double(p));
  }
  CHECK(e.peak_power == peak);
  REQUIRE(e.prediction.has_value());
  REQUIRE(e.prediction->views.size() == 7);
  REQUIRE(e.views.size() == 7);
  double power_db = 0.0, amplitude_db = 0.0, target_db = 0.0, similarity = 0.0;
  for (std::size_t n = 0; n < 7; ++n) {
    const Scores& view = e.prediction->views[n];
    const Image<float>&image = s.predictions[n], &truth = s.truth[n].power;
    CHECK(e.views[n].name == s.truth[n].name);
    CHECK(e.views[n].azimuth_rad == s.truth[n].acquisition.azimuth_rad);
    CHECK(view.psnr_power_db == Approx(double_psnr(image, truth, peak, false)).epsilon(1e-9));
    CHECK(view.psnr_amplitude_db == Approx(double_psnr(image, truth, peak, true)).epsilon(1e-6));
    CHECK(view.ssim_power == ssim(image, truth, peak));
    REQUIRE(view.psnr_target_power_db.has_value());
    CHECK(*view.psnr_target_power_db == masked_psnr_db(image, truth, peak, target_mask(truth)));
    CHECK_FALSE(view.lpips.has_value());
    power_db += view.psnr_power_db / 7;
    amplitude_db += view.psnr_amplitude_db / 7;
    target_db += *view.psnr_target_power_db / 7;
    similarity += view.ssim_power / 7;
  }
  CHECK(e.prediction->mean.psnr_power_db == Approx(power_db).epsilon(1e-12));
  CHECK(e.prediction->mean.psnr_amplitude_db == Approx(amplitude_db).epsilon(1e-12));
  CHECK(*e.prediction->mean.psnr_target_power_db == Approx(target_db).epsilon(1e-12));
  CHECK(e.prediction->mean.ssim_power == Approx(similarity).epsilon(1e-12));
  CHECK(e.prediction->n_capped == 0);
}

TEST_CASE("baselines stand beside the prediction, on the same views") {
  const Scene s;
  const Evaluation e = evaluate(s.truth, s.predictions, s.training);
  const std::vector<Baseline> baselines = default_baselines(s.training);
  REQUIRE(baselines.size() == 4);
  REQUIRE(e.baselines.size() == 4);
  for (std::size_t m = 0; m < 4; ++m) {
    const Baseline& b = baselines[m];
    CHECK(e.baselines[m].name == name(b));
    REQUIRE(e.baselines[m].views.size() == 7);
    const Image<float> image =
        interpolate_view(s.training, s.truth[4].acquisition, b.method, b.plane_height_m);
    CHECK(e.baselines[m].views[4].psnr_power_db == psnr_db(image, s.truth[4].power, e.peak_power));
  }
  // The spot stands a metre above the aim point.
  CHECK(baselines[2].plane_height_m == 0.0);
  CHECK(baselines[3].plane_height_m == Approx(1.0).margin(0.06));
  REQUIRE(e.best_baseline() != nullptr);
  CHECK(e.best_baseline()->name == e.baselines[3].name);
  CHECK(e.best_baseline()->name.find("rotated, then linear (plane at ") == 0);
  CHECK(*e.margin_db() ==
        Approx(e.prediction->mean.psnr_power_db - e.best_baseline()->mean.psnr_power_db)
            .epsilon(1e-12));

  EvaluationSettings settings;
  settings.baselines = {{Interpolation::linear}};
  const Evaluation alone = evaluate(s.truth, {}, s.training, settings);
  CHECK_FALSE(alone.prediction.has_value());
  CHECK_FALSE(alone.margin_db().has_value());
  REQUIRE(alone.baselines.size() == 1);
  CHECK(alone.baselines[0].mean.psnr_power_db == e.baselines[1].mean.psnr_power_db);
}

TEST_CASE("equal images score a number, and blank ones have no target") {
  Scene s;
  s.predictions[2] = s.truth[2].power;
  s.truth[5].power = Image<float>(40, 48);
  const Evaluation e = evaluate(s.truth, s.predictions, s.training);
  CHECK(e.prediction->n_capped == 1);
  CHECK(e.prediction->views[2].psnr_power_db == kMostPsnr_db);
  CHECK(e.prediction->views[2].psnr_amplitude_db == kMostPsnr_db);
  CHECK(*e.prediction->views[2].psnr_target_power_db == kMostPsnr_db);
  CHECK(e.prediction->views[2].ssim_power == Approx(1.0).epsilon(1e-14));
  CHECK_FALSE(e.prediction->views[5].psnr_target_power_db.has_value());
  CHECK(std::isfinite(e.prediction->mean.psnr_power_db));
  double target_db = 0.0;
  for (const std::size_t n : {0, 1, 2, 3, 4, 6})
    target_db += *e.prediction->views[n].psnr_target_power_db / 6;
  CHECK(*e.prediction->mean.psnr_target_power_db == Approx(target_db).epsilon(1e-12));

  s.truth = {s.truth[5]};
  s.predictions = {Image<float>(40, 48)};
  const Evaluation blank = evaluate(s.truth, s.predictions, s.training);
  CHECK(blank.prediction->mean.psnr_power_db == kMostPsnr_db);
  CHECK_FALSE(blank.prediction->mean.psnr_target_power_db.has_value());
}

TEST_CASE("LPIPS is asked of the caller, one view after the other") {
  const Scene s;
  EvaluationSettings settings;
  std::vector<double> asked;
  settings.lpips = [&](const Image<float>& power, const Image<float>& truth, double peak) {
    CHECK_FALSE(in_parallel_region());
    asked.push_back(relative_l2_error(power, truth) / peak);
    return asked.back();
  };
  std::atomic<std::uint64_t> last_done{0}, last_total{0};
  Monitor monitor;
  monitor.progress = [&](std::string_view, std::uint64_t done, std::uint64_t total) {
    last_done = done;
    last_total = total;
  };
  const Evaluation e = evaluate(s.truth, s.predictions, s.training, settings, monitor);
  REQUIRE(asked.size() == 5 * 7);
  CHECK(*e.prediction->views[3].lpips == asked[3]);
  CHECK(*e.baselines[0].views[0].lpips == asked[7]);
  double sum = 0.0;
  for (int n = 0; n < 7; ++n) sum += asked[static_cast<std::size_t>(n)];
  CHECK(*e.prediction->mean.lpips == Approx(sum / 7).epsilon(1e-12));
  CHECK(last_done == last_total);
  CHECK(last_total == 2 * 5 * 7);
}

TEST_CASE("scores do not depend on the number of threads") {
  const Scene s;
  const Evaluation many = evaluate(s.truth, s.predictions, s.training);
  const ThreadLimit one(1);
  const Evaluation alone = evaluate(s.truth, s.predictions, s.training);
  CHECK(alone.prediction->mean.psnr_power_db == many.prediction->mean.psnr_power_db);
  CHECK(alone.baselines[2].mean.ssim_power == many.baselines[2].mean.ssim_power);
}

TEST_CASE("without training images the caller names the peak, and there are no baselines") {
  const Scene s;
  EvaluationSettings settings;
  settings.peak_power = 2.0;
  const Evaluation e = evaluate(s.truth, s.predictions, {}, settings);
  CHECK(e.peak_power == 2.0);
  CHECK(e.baselines.empty());
  CHECK(e.best_baseline() == nullptr);
  CHECK(e.prediction->views[0].psnr_power_db == psnr_db(s.predictions[0], s.truth[0].power, 2.0));
}

TEST_CASE("evaluations that mean nothing are refused") {
  Scene s;
  CHECK_THROWS_AS(evaluate({}, {}, s.training), UsageError);
  CHECK_THROWS_AS(evaluate(s.truth, s.predictions, {}), UsageError);
  CHECK_THROWS_AS(evaluate(s.truth, std::span(s.predictions).first(3), s.training), UsageError);
  EvaluationSettings settings;
  settings.peak_power = 1.0;
  settings.baselines = {{Interpolation::linear}};
  CHECK_THROWS_AS(evaluate(s.truth, s.predictions, {}, settings), UsageError);

  const std::vector<PosedImage> blank = {flat(seen_from(0), 0.0f)};
  CHECK_THROWS_AS(evaluate(s.truth, s.predictions, blank), InputError);

  const auto message = [&]() -> std::string {
    try {
      evaluate(s.truth, s.predictions, s.training);
    } catch (const Error& e) {
      return e.what();
    }
    return "accepted";
  };
  s.predictions[3](1, 1) = std::numeric_limits<float>::quiet_NaN();
  CHECK(message().find("view3 holds values that are not finite") != std::string::npos);
  s.predictions[3] = Image<float>(3, 4);
  CHECK(message().find("view3 has 3 x 4 pixels") != std::string::npos);

  const std::atomic<bool> stop = true;
  Monitor monitor;
  monitor.stop = &stop;
  CHECK_THROWS_AS(evaluate(s.truth, {}, s.training, {}, monitor), Interrupted);
}
