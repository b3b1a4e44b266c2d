// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/image_analysis.h"

#include <algorithm>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "speckle.h"

using namespace sarnerf;

namespace {

void fill(Image<float>& image, int i0, int i1, int j0, int j1, float value) {
  for (int i = i0; i < i1; ++i)
    for (int j = j0; j < j1; ++j) image(i, j) = value;
}

/// A ground of 0.5, a bright square of 10 × 10 and a dark one of 10 × 20 behind it.
Image<float> scene() {
  Image<float> image(60, 60, 0.5f);
  fill(image, 20, 30, 15, 25, 50.0f);
  fill(image, 20, 30, 25, 45, 0.0f);
  return image;
}

std::size_t count(const Image<std::uint8_t>& mask) {
  return static_cast<std::size_t>(std::count(mask.pixels().begin(), mask.pixels().end(), 1));
}

}  // namespace

TEST_CASE("without a blur the regions are what is drawn") {
  const auto r = find_regions(scene(), {.blur_pixels = 0.0, .target_db = 6.0, .shadow_db = 6.0});
  REQUIRE(r.has_value());
  CHECK(r->background_power == 0.5);
  CHECK(count(r->target) == 100);
  CHECK(count(r->shadow) == 200);
  CHECK(count(r->background) == 3600 - 300);
  CHECK(r->target(20, 15) == 1);
  CHECK(r->target(19, 15) == 0);
  CHECK(r->shadow(29, 44) == 1);
  CHECK(r->shadow(29, 45) == 0);
}

TEST_CASE("thresholds are decibels from the background, and a factor changes nothing") {
  Image<float> image(40, 40, 2.0f);
  fill(image, 0, 5, 0, 10, 2.0f * 4.9f);     // 6.9 dB
  fill(image, 10, 15, 0, 10, 2.0f * 5.1f);   // 7.1 dB
  fill(image, 20, 25, 0, 10, 2.0f / 3.1f);   // −4.9 dB
  fill(image, 30, 35, 0, 10, 2.0f / 3.25f);  // −5.1 dB
  for (const float gain : {1.0f, 1e-6f}) {
    Image<float> scaled = image;
    for (float& p : scaled.pixels()) p *= gain;
    const auto r = find_regions(scaled, {.blur_pixels = 0.0, .target_db = 7.0, .shadow_db = 5.0});
    REQUIRE(r.has_value());
    CHECK(count(r->target) == 50);
    CHECK(r->target(12, 3) == 1);
    CHECK(count(r->shadow) == 50);
    CHECK(r->shadow(32, 3) == 1);
  }
}

TEST_CASE("speckle of four looks changes the regions of a clean scene little") {
  const Image<float> clean = scene();
  Image<float> speckled = test::speckle(60, 4, 0.0, 9);
  for (std::size_t n = 0; n < clean.pixels().size(); ++n)
    speckled.pixels()[n] *= clean.pixels()[n];
  const auto truth = find_regions(clean), found = find_regions(speckled);
  REQUIRE(truth.has_value());
  REQUIRE(found.has_value());
  CHECK(*intersection_over_union(found->target, truth->target) > 0.85);
  CHECK(*intersection_over_union(found->shadow, truth->shadow) > 0.85);
}

TEST_CASE("an image without a background has no regions") {
  Image<float> image(40, 40);
  fill(image, 5, 10, 5, 10, 1.0f);
  CHECK_FALSE(find_regions(image).has_value());
  CHECK_FALSE(find_regions(Image<float>()).has_value());
  CHECK_THROWS_AS(find_regions(image, {.target_db = 0.0}), UsageError);
  CHECK_THROWS_AS(find_regions(image, {.shadow_db = -5.0}), UsageError);
}

TEST_CASE("the intersection over the union counts pixels") {
  Image<std::uint8_t> a(4, 4), b(4, 4);
  CHECK_FALSE(intersection_over_union(a, b).has_value());
  for (int j = 0; j < 4; ++j) a(0, j) = 1;
  CHECK(intersection_over_union(a, b) == 0.0);
  CHECK(intersection_over_union(a, a) == 1.0);
  for (int i = 0; i < 4; ++i) b(i, 0) = 1;
  CHECK(intersection_over_union(a, b) == 1.0 / 7.0);
  CHECK_THROWS_AS(intersection_over_union(a, Image<std::uint8_t>(4, 3)), UsageError);
}

TEST_CASE("of a mask what hangs together with the middle is kept") {
  Image<std::uint8_t> mask(20, 30);
  const auto draw = [&](int i0, int i1, int j0, int j1) {
    for (int i = i0; i < i1; ++i)
      for (int j = j0; j < j1; ++j) mask(i, j) = 1;
  };
  draw(8, 12, 10, 14);   // within 3 pixels of the middle, (10, 15)
  draw(11, 12, 14, 28);  // leaves it along a row
  draw(12, 14, 28, 30);  // touches that by a corner alone
  draw(0, 4, 0, 6);      // apart
  const Image<std::uint8_t> kept = connected_to_middle(mask, 3);
  CHECK(count(kept) == 16 + 14);
  CHECK(kept(11, 27) == 1);
  CHECK(kept(12, 28) == 0);
  CHECK(kept(2, 2) == 0);
  CHECK(count(connected_to_middle(mask, 0)) == 0);     // the middle itself is empty
  CHECK(count(connected_to_middle(mask, 100)) == count(mask));
  CHECK(connected_to_middle(Image<std::uint8_t>(), 5).pixels().empty());
}
