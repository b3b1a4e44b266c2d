// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/image_analysis.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"

using namespace sarnerf;

TEST_CASE("the target is what exceeds a share of the peak, and what is near it") {
  std::mt19937 random(1);
  std::exponential_distribution<float> power(1.0f);
  Image<float> image(23, 17);
  for (float& p : image.pixels()) p = power(random);
  for (const int reach : {0, 1, 2, 5, 40}) {
    const TargetRule rule{0.7, reach};
    const Image<std::uint8_t> mask = target_mask(image, rule);
    const float peak = *std::max_element(image.pixels().begin(), image.pixels().end());
    int n_wrong = 0, n_inside = 0;
    for (int i = 0; i < image.n_azimuth(); ++i) {
      for (int j = 0; j < image.n_range(); ++j) {
        bool near = false;
        for (int a = 0; a < image.n_azimuth(); ++a) {
          for (int b = 0; b < image.n_range(); ++b) {
            near |= double(image(a, b)) > 0.7 * double(peak) && std::abs(a - i) <= reach &&
                    std::abs(b - j) <= reach;
          }
        }
        n_wrong += mask(i, j) != (near ? 1 : 0);
        n_inside += near;
      }
    }
    CAPTURE(reach);
    CHECK(n_wrong == 0);
    CHECK(n_inside > 0);
  }
}

TEST_CASE("PSNR over the target sees the target only") {
  Image<float> truth(9, 9);
  truth(4, 4) = 2.0f;
  Image<float> image = truth;
  image(4, 5) = 0.1f;  // inside the dilated target of 3 x 3 pixels
  image(0, 0) = 1.0f;  // outside
  const Image<std::uint8_t> mask = target_mask(truth, {0.01, 1});
  CHECK(*masked_psnr_db(image, truth, 2.0, mask) ==
        Approx(10 * std::log10(4.0 / (0.01 / 9))).epsilon(1e-6));
  const Image<std::uint8_t> all(9, 9, std::uint8_t{1});
  CHECK(*masked_psnr_db(image, truth, 2.0, all) ==
        Approx(psnr_db(image, truth, 2.0)).epsilon(1e-12));
  image(4, 5) = 0.0f;
  CHECK(std::isinf(*masked_psnr_db(image, truth, 2.0, mask)));
}

TEST_CASE("a blank truth has no target, and no PSNR over it") {
  const Image<float> blank(4, 5);
  const Image<std::uint8_t> mask = target_mask(blank);
  CHECK(std::count(mask.pixels().begin(), mask.pixels().end(), 0) == 20);
  CHECK_FALSE(masked_psnr_db(Image<float>(4, 5, 1.0f), blank, 1.0, mask).has_value());
  CHECK(target_mask(Image<float>()).pixels().empty());
}

TEST_CASE("target rules without a meaning are refused") {
  const Image<float> image(2, 2, 1.0f);
  CHECK_THROWS_AS(target_mask(image, {1.0, 0}), UsageError);
  CHECK_THROWS_AS(target_mask(image, {-0.1, 0}), UsageError);
  CHECK_THROWS_AS(target_mask(image, {0.1, -1}), UsageError);
  CHECK_THROWS_AS(masked_psnr_db(image, image, 0.0, target_mask(image)), UsageError);
  CHECK_THROWS_AS(masked_psnr_db(image, image, 1.0, Image<std::uint8_t>(2, 3)), UsageError);
}
