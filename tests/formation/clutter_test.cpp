// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/formation/clutter.h"

#include <vector>

#include "catch.h"
#include "geometry/acquisitions.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using sarnerf::test::view_of;

namespace {

ImageFormation radar(double looks, double azimuth_m, double range_m, std::uint64_t seed) {
  ImageFormation f;
  f.resolution_m = {azimuth_m, range_m};
  f.window = window_from_text("taylor:-35,4");
  f.looks = looks;
  f.seed = seed;
  return f;
}

/// Images of uniform clutter with a bright target, of different gains.
std::vector<Image<float>> measured(double looks, double azimuth_m, double range_m, int count) {
  std::vector<Image<float>> images;
  for (int n = 0; n < count; ++n) {
    Image<float> image(128, 128, 1.0f);
    for (int i = 50; i < 70; ++i)
      for (int j = 55; j < 75; ++j) image(i, j) = 300.0f;
    form_image(image, radar(looks, azimuth_m, range_m, static_cast<std::uint64_t>(n)), view_of(73.0, 1000.0, 128, 128, 0.2), 0.0);
    for (float& p : image.pixels()) p *= static_cast<float>(0.01 + n);
    images.push_back(std::move(image));
  }
  return images;
}

}  // namespace

TEST_CASE("looks and resolution come back from the clutter around a target", "[clutter]") {
  for (const double looks : {1.0, 4.0}) {
    const auto model = fitted_clutter(measured(looks, 0.3, 0.45, 8), window_from_text("taylor:-35,4"), 0.2, 0.2);
    REQUIRE((model && model->radar.resolution_m));
    CHECK(model->radar.looks == Approx(looks).epsilon(0.06));
    CHECK(model->texture_variance < 0.03);
    CHECK(model->radar.resolution_m->first == Approx(0.3).epsilon(0.05));
    CHECK(model->radar.resolution_m->second == Approx(0.45).epsilon(0.05));
  }
}

TEST_CASE("texture beneath speckle of one look comes back, and so does the resolution", "[clutter]") {
  ClutterModel truth{radar(1.0, 0.3, 0.35, 0), 0.3};
  std::vector<Image<float>> images;
  for (std::uint64_t n = 0; n < 24; ++n) {
    truth.radar.seed = n;
    images.emplace_back(128, 128, 2.0f);
    multiply_by_clutter(images.back(), truth, view_of(73.0, 1000.0, 128, 128, 0.2));
  }
  const auto model = fitted_clutter(images, window_from_text("taylor:-35,4"), 0.2, 0.2);
  REQUIRE((model && model->radar.resolution_m));
  CHECK(model->radar.looks == 1.0);
  // The brightest clutter counts as a target, so that some 15 % of the variance are missing: 0.246 to 0.266 in twelve such sets.
  CHECK(model->texture_variance == Approx(0.256).margin(0.02));
  CHECK(model->radar.resolution_m->first == Approx(0.3).epsilon(0.05));
  CHECK(model->radar.resolution_m->second == Approx(0.35).epsilon(0.05));
}

TEST_CASE("speckle put on a mean is that of a measured image", "[clutter]") {
  std::vector<Image<float>> images;
  for (std::uint64_t n = 0; n < 8; ++n) {
    images.emplace_back(128, 128, 3.0f);
    multiply_by_clutter(images.back(), {radar(1.0, 0.3, 0.45, 100 + n)}, view_of(73.0, 1000.0, 128, 128, 0.2));
  }
  const auto put = clutter_statistics(images), real = clutter_statistics(measured(1.0, 0.3, 0.45, 8));
  REQUIRE((put && real));
  CHECK(put->looks == Approx(real->looks).epsilon(0.06));
  for (std::size_t lag = 0; lag < ClutterStatistics::kLags; ++lag) {
    CHECK(put->azimuth[lag] == Approx(real->azimuth[lag]).margin(0.02));
    CHECK(put->range[lag] == Approx(real->range[lag]).margin(0.02));
  }
  // The mean stays, up to the border.
  double sum = 0.0;
  for (const Image<float>& image : images)
    for (int j = 0; j < 128; ++j) sum += double{image(0, j)} + double{image(127, j)};
  CHECK(sum / (8 * 256) == Approx(3.0).epsilon(0.1));
}

TEST_CASE("clutter of independent pixels has no resolution, and black images no clutter", "[clutter]") {
  std::vector<Image<float>> images;
  for (std::uint64_t n = 0; n < 8; ++n) {
    images.emplace_back(128, 128, 1.0f);
    ImageFormation f;
    f.looks = 1.0;
    f.seed = n;
    multiply_by_clutter(images.back(), {f}, view_of(45.0, 1000.0, 128, 128, 0.2));
  }
  const auto statistics = clutter_statistics(images);
  REQUIRE(statistics);
  CHECK(statistics->azimuth[0] == Approx(0.0).margin(0.02));
  CHECK(!fitted_clutter(images, window_from_text("taylor:-35,4"), 0.2, 0.2)->radar.resolution_m);
  CHECK(!clutter_statistics(std::vector{Image<float>(64, 64, 0.0f)}));
}

TEST_CASE("hidden pixels do not count as clutter", "[clutter]") {
  // Faint returns of a vehicle: too weak for a target, and brighter than the clutter. They look like fewer looks.
  const auto clutter = [](float block) {
    std::vector<Image<float>> images;
    for (std::uint64_t n = 0; n < 4; ++n) {
      images.emplace_back(128, 128, 1.0f);
      for (int i = 40; i < 88; ++i)
        for (int j = 40; j < 88; ++j) images.back()(i, j) = block;
      multiply_by_clutter(images.back(), {radar(1.0, 0.3, 0.45, n)}, view_of(73.0, 1000.0, 128, 128, 0.2));
    }
    return images;
  };
  Image<std::uint8_t> block(128, 128);
  for (int i = 36; i < 92; ++i)
    for (int j = 36; j < 92; ++j) block(i, j) = 1;
  const auto without_block = [&](float power) {
    ClutterSums sums;
    for (const Image<float>& image : clutter(power)) sums.add(image, block);
    return sums.statistics();
  };
  const auto plain = without_block(1.0f), seen = clutter_statistics(clutter(2.5f)), unseen = without_block(2.5f);
  REQUIRE((plain && seen && unseen));
  CHECK(unseen->n_pixels < 4 * (128 * 128 - 56 * 56) + 1);
  CHECK(seen->looks < 0.85 * plain->looks);
  CHECK(unseen->looks == Approx(plain->looks).epsilon(0.03));
  for (std::size_t lag = 0; lag < ClutterStatistics::kLags; ++lag) CHECK(unseen->range[lag] == Approx(plain->range[lag]).margin(0.02));
  ClutterSums sums;
  CHECK_THROWS_AS(sums.add(clutter(1.0f)[0], Image<std::uint8_t>(64, 128)), UsageError);
  CHECK_THROWS_AS(sums.add(Image<float>(64, 64), Image<std::uint8_t>(64, 128)), UsageError);
}

TEST_CASE("sums of groups of images give the statistics of all of them", "[clutter]") {
  const std::vector<Image<float>> images = measured(1.0, 0.3, 0.45, 4);
  ClutterSums first, second;
  for (std::size_t n = 0; n < 4; ++n) (n < 3 ? first : second).add(images[n]);
  first.add(second);
  const auto together = clutter_statistics(images), added = first.statistics();
  REQUIRE((together && added));
  CHECK(added->n_pixels == together->n_pixels);
  CHECK(added->looks == Approx(together->looks).epsilon(1e-12));
  for (std::size_t lag = 0; lag < ClutterStatistics::kLags; ++lag) {
    CHECK(added->azimuth[lag] == Approx(together->azimuth[lag]).margin(1e-12));
    CHECK(added->range[lag] == Approx(together->range[lag]).margin(1e-12));
  }
}
