// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/evaluation.h"

#include "catch.h"
#include "posed_images.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/image_analysis.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Flat views a degree apart, view n of value n + 1, in an order that is not that of azimuth.
std::vector<PosedImage> degrees(int count, double incidence_deg = 45.0) {
  std::vector<PosedImage> views;
  for (int n = 0; n < count; ++n) {
    const int place = (n * 7) % count;
    views.push_back(flat(seen_from(place, incidence_deg), static_cast<float>(place + 1),
                         "view" + std::to_string(place)));
  }
  return views;
}

double middle(const Image<float>& image) { return double(image(20, 24)); }

}  // namespace

TEST_CASE("odd views within reach are the truth, even ones its true neighbours") {
  const std::vector<PosedImage> views = degrees(20);
  const DespeckledTruth truth = despeckled_truth(views, rad_from_deg(3.0));
  // First, third, … by azimuth: 0°, 2°, …, 18°.
  REQUIRE(truth.views.size() == 10);
  REQUIRE(truth.true_neighbours.size() == 10);
  REQUIRE(truth.which.size() == 10);
  for (std::size_t n = 0; n < 10; ++n) {
    const int azimuth = 2 * static_cast<int>(n);
    CHECK(truth.views[n].name == "view" + std::to_string(azimuth));
    CHECK(views[truth.which[n]].name == truth.views[n].name);
    CHECK(truth.views[n].acquisition.azimuth_rad == seen_from(azimuth).azimuth_rad);
    double sum = 0.0, others = 0.0;
    int n_sum = 0, n_others = 0;
    for (int a = std::max(0, azimuth - 3); a <= std::min(19, azimuth + 3); ++a) {
      if (a % 2 == 0) sum += a + 1, ++n_sum;
      if (a % 2 == 1) others += a + 1, ++n_others;
    }
    CHECK(middle(truth.views[n].power) == Approx(sum / n_sum).epsilon(1e-6));
    CHECK(middle(truth.true_neighbours[n]) == Approx(others / n_others).epsilon(1e-6));
  }
}

TEST_CASE("pitches are apart, and azimuths go around the circle") {
  std::vector<PosedImage> views = degrees(6);
  for (PosedImage& image : degrees(6, 50.0)) {
    for (float& p : image.power.pixels()) p += 100.0f;
    views.push_back(std::move(image));
  }
  const DespeckledTruth truth = despeckled_truth(views, rad_from_deg(2.0));
  REQUIRE(truth.views.size() == 6);
  CHECK(middle(truth.views[1].power) == Approx(3.0).epsilon(1e-6));    // 0, 2, 4 degrees
  CHECK(middle(truth.views[4].power) == Approx(103.0).epsilon(1e-6));  // the same at the other pitch

  const std::vector<PosedImage> around{flat(seen_from(1.0), 1.0f), flat(seen_from(2.0), 2.0f),
                                       flat(seen_from(358.0), 4.0f), flat(seen_from(359.0), 8.0f)};
  const DespeckledTruth few = despeckled_truth(around, rad_from_deg(3.0));
  REQUIRE(few.views.size() == 2);
  CHECK(middle(few.views[0].power) == Approx(2.5).epsilon(1e-6));       // 1 and 358 degrees
  CHECK(middle(few.true_neighbours[0]) == Approx(5.0).epsilon(1e-6));  // 2 and 359 degrees
}

TEST_CASE("views are turned, so that what stands on the plane stays sharp") {
  const glm::dvec3 place = seen_from(0).aim_m + glm::dvec3(4.0, 0.0, -3.0);
  std::vector<PosedImage> views;
  for (int n = 0; n < 13; ++n) views.push_back(spot(seen_from(2.0 * n), place, 3.0));
  const DespeckledTruth truth = despeckled_truth(views, rad_from_deg(8.0));
  for (std::size_t n = 0; n < truth.views.size(); ++n) {
    const PosedImage exact = spot(truth.views[n].acquisition, place, 3.0);
    const glm::dvec2 expected = centroid_m(exact.acquisition, exact.power);
    for (const Image<float>* image : {&truth.views[n].power, &truth.true_neighbours[n]}) {
      const glm::dvec2 found = centroid_m(exact.acquisition, *image);
      CHECK(found.x == Approx(expected.x).margin(0.02));
      CHECK(found.y == Approx(expected.y).margin(0.02));
    }
  }
}

TEST_CASE("views without neighbours are left out, and odd reaches are refused") {
  const std::vector<PosedImage> views = degrees(8);
  CHECK(despeckled_truth(views, rad_from_deg(1.5)).views.empty());  // odd ones are 2 degrees apart
  CHECK(despeckled_truth({}, rad_from_deg(3.0)).views.empty());
  CHECK_THROWS_AS(despeckled_truth(views, 0.0), UsageError);
  CHECK_THROWS_AS(despeckled_truth(views, 4.0), UsageError);
}

TEST_CASE("the evaluation takes the predictions of the truth's views, and true neighbours bound it") {
  const std::vector<PosedImage> views = degrees(12);
  const DespeckledTruth truth = despeckled_truth(views, rad_from_deg(3.0));
  std::vector<Image<float>> predictions;
  for (const PosedImage& view : views) predictions.push_back(view.power);
  EvaluationSettings settings;
  settings.peak_power = 12.0;
  const Evaluation e = evaluate_despeckled(truth, predictions, {}, settings);
  REQUIRE(e.views.size() == truth.views.size());
  for (std::size_t n = 0; n < e.views.size(); ++n) {
    CHECK(e.prediction->views[n].psnr_power_db ==
          score_view(predictions[truth.which[n]], truth.views[n], 12.0).psnr_power_db);
  }
  REQUIRE(e.bounds.size() == 2);
  CHECK(e.bounds[0].name == "true neighbours");
  CHECK(e.bounds[1].views[2].psnr_power_db ==
        score_view(gaussian_blur(truth.true_neighbours[2], 1.0), truth.views[2], 12.0).psnr_power_db);
  CHECK_THROWS_AS(evaluate_despeckled(truth, std::span(predictions).first(2), {}, settings),
                  UsageError);
}
