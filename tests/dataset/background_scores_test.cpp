// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/evaluation.h"

#include <cmath>

#include "../core/speckle.h"
#include "catch.h"
#include "posed_images.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/metrics.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A ground of 0.1, on it a target of 3 with two bright points and a shadow behind it, moved by some pixels.
PosedImage scene(int shift_i = 0, int shift_j = 0) {
  PosedImage image = flat(seen_from(0), 0.1f, "scene");
  for (int i = 12; i < 24; ++i) {
    for (int j = 10; j < 16; ++j) image.power(i + shift_i, j + shift_j) = 3.0f;
    for (int j = 16; j < 30; ++j) image.power(i + shift_i, j + shift_j) = 0.0f;
  }
  image.power(14 + shift_i, 12 + shift_j) = 9.0f;
  image.power(21 + shift_i, 13 + shift_j) = 8.0f;
  return image;
}

const BackgroundRule kTwoPoints{.n_scatterers = 2};

}  // namespace

TEST_CASE("the truth itself has no error, all overlap and its own looks") {
  const PosedImage truth = scene();
  const BackgroundScores s = score_background(truth.power, truth, 9.0);
  CHECK(s.log_amplitude_error_db == 0.0);
  CHECK(s.log_amplitude_psnr_db == kMostPsnr_db);
  CHECK(s.target_iou == 1.0);
  CHECK(s.shadow_iou == 1.0);
  CHECK(s.scatterer_error_m == 0.0);
  REQUIRE(s.looks.has_value());
  CHECK(*s.looks == *s.looks_of_truth);
}

TEST_CASE("a factor is an error of log amplitude, and changes neither regions nor places") {
  const PosedImage truth = scene();
  Image<float> twice = truth.power;
  for (float& p : twice.pixels()) p *= 2.0f;
  const BackgroundScores s = score_background(twice, truth, 9.0, kTwoPoints);
  CHECK(s.log_amplitude_error_db == log_amplitude_error_db(twice, truth.power, 9.0));
  CHECK(s.log_amplitude_psnr_db ==
        Approx(20.0 * std::log10(40.0 / s.log_amplitude_error_db)).epsilon(1e-12));
  CHECK(s.target_iou == 1.0);
  CHECK(s.shadow_iou == 1.0);
  CHECK(s.scatterer_error_m == 0.0);
}

TEST_CASE("what stands elsewhere overlaps less, and is off by as far") {
  const PosedImage truth = scene();
  BackgroundRule rule = kTwoPoints;
  rule.regions.blur_pixels = 0.0;
  // 2 of 12 rows: (12 − 2) / (12 + 2) of both regions; pixels of 0.5 m.
  const BackgroundScores s = score_background(scene(2, 0).power, truth, 9.0, rule);
  CHECK(*s.target_iou == Approx(10.0 / 14.0).epsilon(1e-12));
  CHECK(*s.shadow_iou == Approx(10.0 / 14.0).epsilon(1e-12));
  CHECK(*s.scatterer_error_m == Approx(1.0).epsilon(1e-12));
  // 2 bins of 0.4 m: 4 of 8 columns of the target, 12 of 16 of the shadow.
  const BackgroundScores t = score_background(scene(0, 2).power, truth, 9.0, rule);
  CHECK(*t.target_iou == Approx(4.0 / 8.0).epsilon(1e-12));
  CHECK(*t.shadow_iou == Approx(12.0 / 16.0).epsilon(1e-12));
  CHECK(*t.scatterer_error_m == Approx(0.8).epsilon(1e-12));
}

TEST_CASE("looks are counted in the truth's background alone") {
  PosedImage truth = scene();
  const Image<float> of_one = speckle(48, 1, 0.0, 3), of_sixteen = speckle(48, 16, 0.0, 4);
  Image<float> prediction = truth.power;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 48; ++j) {
      truth.power(i, j) *= of_one(i, j);
      prediction(i, j) *= of_sixteen(i, j);
    }
  }
  const BackgroundScores s = score_background(prediction, truth, 9.0);
  CHECK(*s.looks_of_truth == Approx(1.05).epsilon(0.25));
  CHECK(*s.looks == Approx(16.4).epsilon(0.25));
}

TEST_CASE("a blank prediction overlaps nowhere and misses the scatterers by the diagonal") {
  const PosedImage truth = scene();
  const BackgroundScores s = score_background(Image<float>(40, 48), truth, 9.0);
  CHECK(s.target_iou == 0.0);
  CHECK(s.shadow_iou == 0.0);
  CHECK(*s.scatterer_error_m == Approx(std::hypot(40 * 0.5, 48 * 0.4)).epsilon(1e-12));
  CHECK_FALSE(s.looks.has_value());
  CHECK_THROWS_AS(score_background(Image<float>(40, 47), truth, 9.0), UsageError);
  CHECK_THROWS_AS(score_background(truth.power, truth, 0.0), UsageError);
}

TEST_CASE("a truth of ground alone has neither regions nor scatterers to miss") {
  const PosedImage truth = flat(seen_from(0), 0.1f);
  const BackgroundScores s = score_background(truth.power, truth, 1.0);
  CHECK_FALSE(s.target_iou.has_value());
  CHECK_FALSE(s.shadow_iou.has_value());
  CHECK_FALSE(s.scatterer_error_m.has_value());
  CHECK(s.looks == kMostLooks);
}

TEST_CASE("means are over the views that have a value, of looks the harmonic one") {
  BackgroundScores a, b;
  a.log_amplitude_error_db = 2.0;
  b.log_amplitude_error_db = 4.0;
  a.looks = 1.0;
  b.looks = 3.0;
  a.target_iou = 0.5;
  const BackgroundScores views[] = {a, b};
  const BackgroundScores m = mean_of(views);
  CHECK(m.log_amplitude_error_db == 3.0);
  CHECK(*m.looks == Approx(2.0 / (1.0 / 1.0 + 1.0 / 3.0)).epsilon(1e-12));
  CHECK(m.target_iou == 0.5);
  CHECK_FALSE(m.shadow_iou.has_value());
  CHECK_THROWS_AS(mean_of(std::span<const BackgroundScores>{}), UsageError);
}

TEST_CASE("an evaluation has these scores where the truth has a background, and not elsewhere") {
  std::vector<PosedImage> training, truth;
  for (int n = 0; n < 12; ++n) {
    training.push_back(scene());
    training.back().acquisition.azimuth_rad = rad_from_deg(30.0 * n);
  }
  truth.push_back(scene(1, 1));
  truth.back().acquisition.azimuth_rad = rad_from_deg(15.0);
  EvaluationSettings settings;
  settings.baselines = {{Interpolation::nearest}};
  settings.bounds = {{"knows it all", {truth[0].power}}};
  const Evaluation e = evaluate(truth, {}, training, settings);
  REQUIRE(e.background.has_value());
  REQUIRE(e.baselines[0].mean.background.has_value());
  const BackgroundScores expected = score_background(training[0].power, truth[0], e.peak_power);
  CHECK(e.baselines[0].views[0].background->log_amplitude_error_db == expected.log_amplitude_error_db);
  CHECK(e.baselines[0].mean.background->target_iou == expected.target_iou);
  // A bound is judged, and is no baseline.
  REQUIRE(e.bounds.size() == 1);
  CHECK(e.bounds[0].mean.psnr_power_db == kMostPsnr_db);
  CHECK(e.best_baseline()->name == "nearest view");

  settings.bounds[0].images.clear();
  CHECK_THROWS_AS(evaluate(truth, {}, training, settings), UsageError);
  settings.bounds.clear();
  truth[0] = spot(seen_from(15.0), seen_from(0).aim_m);
  const Evaluation clean = evaluate(truth, {}, training, settings);
  CHECK_FALSE(clean.background.has_value());
  CHECK_FALSE(clean.baselines[0].views[0].background.has_value());
  CHECK_FALSE(clean.baselines[0].mean.background.has_value());
}
