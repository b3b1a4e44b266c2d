// SPDX-License-Identifier: Apache-2.0
// What images with an impulse response show where nothing is.
#include "ground_scene.h"
#include "sarnerf/nerf/training_set.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

/// A bright square of 9 x 9 pixels, a thousandth of it in the first `n_rows` of 48 rows elsewhere, and below that tails over
/// eight orders of magnitude: neither an even ground nor speckle that anybody could see.
std::vector<PosedImage> square(int n_rows) {
  auto images = ground_scene(12, [](int) { return 1.0; });
  std::mt19937 random(3);
  std::uniform_real_distribution<float> decades(-8.0f, 0.0f);
  for (PosedImage& image : images)
    for (int i = 0; i < 48; ++i)
      for (int j = 0; j < 64; ++j) {
        const bool inside = std::abs(i - 24) < 5 && std::abs(j - 32) < 5;
        image.power(i, j) = inside ? 1.0f : i < n_rows ? 1e-3f : 5e-5f * std::pow(10.0f, decades(random));
      }
  return images;
}

std::size_t n_zeros(const TrainingSet& set) {
  std::size_t n = 0;
  for (const float p : set.training_images().front().power.pixels()) n += p == 0.0f;
  return n;
}

}  // namespace

TEST_CASE("tails of an impulse response are dark where they are most of an image") {
  const TrainingSet set = training_set(square(0), ground_scene_box());
  CHECK(set.tails_are_dark);
  CHECK(n_zeros(set) == 48 * 64 - 81);
  CHECK(set.images.front().power(0, 0) > 0.0f);
}

TEST_CASE("sidelobes over much of an image leave all of it as it is") {
  const TrainingSet set = training_set(square(16), ground_scene_box());
  CHECK_FALSE(set.tails_are_dark);
  CHECK(n_zeros(set) == 0);
}
