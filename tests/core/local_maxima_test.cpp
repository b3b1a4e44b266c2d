// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/image_analysis.h"

#include <cmath>

#include "catch.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

namespace {

/// Peaks of heights 5, 4, 3, 2 and 1 on a floor of 0.1.
Image<float> peaks(int shift_i = 0, int shift_j = 0) {
  Image<float> image(40, 50, 0.1f);
  const int places[5][2] = {{10, 10}, {20, 30}, {8, 40}, {30, 12}, {31, 44}};
  for (int n = 0; n < 5; ++n)
    image(places[n][0] + shift_i, places[n][1] + shift_j) = static_cast<float>(5 - n);
  return image;
}

}  // namespace

TEST_CASE("maxima come strongest first, above the floor, no more than asked for") {
  const auto all = strongest_maxima(peaks(), 0.5);
  REQUIRE(all.size() == 5);
  for (int n = 0; n < 5; ++n) CHECK(all[static_cast<std::size_t>(n)].value == float(5 - n));
  CHECK(all[1].i == 20);
  CHECK(all[1].j == 30);
  CHECK(strongest_maxima(peaks(), 0.5, {.most = 2}).size() == 2);
  CHECK(strongest_maxima(peaks(), 2.0).size() == 3);
  CHECK(strongest_maxima(peaks(), 5.0).empty());
}

TEST_CASE("of maxima nearer than the separation, in metres, the strongest stays") {
  Image<float> image = peaks();
  image(10, 14) = 4.5f;  // 4 pixels along range from the strongest
  const MaximaRule fine{.separation_m = 1.0, .azimuth_spacing_m = 0.5, .range_spacing_m = 0.2};
  CHECK(strongest_maxima(image, 0.5, fine)[1].value == 4.0f);
  const MaximaRule coarse{.separation_m = 1.0, .azimuth_spacing_m = 0.2, .range_spacing_m = 0.25};
  CHECK(strongest_maxima(image, 0.5, coarse)[1].value == 4.5f);
}

TEST_CASE("a plateau is one maximum, and slopes have none") {
  Image<float> image(20, 20);
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) image(i, j) = float(i + j);
  for (int j = 17; j < 20; ++j) image(19, j) = 40.0f;
  const auto found = strongest_maxima(image, 0.0, {.separation_m = 3.0});
  REQUIRE(found.size() == 1);
  CHECK(found[0].i == 19);
}

TEST_CASE("shifted peaks are as far away as they were shifted") {
  const MaximaRule rule{.azimuth_spacing_m = 0.5, .range_spacing_m = 0.2};
  const auto reference = strongest_maxima(peaks(), 0.5, rule);
  CHECK(mean_distance_m(reference, reference, rule) == 0.0);
  CHECK(mean_distance_m(reference, strongest_maxima(peaks(2, 3), 0.5, rule), rule) ==
        Approx(std::hypot(1.0, 0.6)).epsilon(1e-12));
  // Only the strongest was found: the others are as far from it as they stand apart.
  const std::vector<LocalMaximum> one{reference[0]};
  const double expected = (std::hypot(5.0, 4.0) + std::hypot(1.0, 6.0) + std::hypot(10.0, 0.4) +
                           std::hypot(10.5, 6.8)) / 5.0;
  CHECK(mean_distance_m(reference, one, rule) == Approx(expected).epsilon(1e-12));
  CHECK(mean_distance_m(one, reference, rule) == 0.0);
}

TEST_CASE("rules of maxima that mean nothing are refused") {
  const Image<float> image = peaks();
  CHECK_THROWS_AS(strongest_maxima(image, 0.0, {.most = 0}), UsageError);
  CHECK_THROWS_AS(strongest_maxima(image, 0.0, {.separation_m = -1.0}), UsageError);
  CHECK_THROWS_AS(strongest_maxima(image, 0.0, {.range_spacing_m = 0.0}), UsageError);
  CHECK_THROWS_AS(mean_distance_m({}, strongest_maxima(image, 0.5)), UsageError);
}
