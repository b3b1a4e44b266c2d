// SPDX-License-Identifier: Apache-2.0
// Damaged pixels: found wherever they are, and nothing else is taken for one.
#include "sarnerf/dataset/posed_image.h"

#include <random>

#include "catch.h"

using namespace sarnerf;

namespace {

/// One-look speckle of mean power 1 with a target of 30 pixels of power 200, seen in all views.
std::vector<PosedImage> speckled_views(std::size_t n_views, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<float> speckle(1.0f);
  std::vector<PosedImage> images(n_views);
  for (PosedImage& image : images) {
    image.name = "images/view_" + std::to_string(&image - images.data()) + ".tif";
    image.power = Image<float>(64, 64);
    for (float& p : image.power.pixels()) p = speckle(random);
    for (int j = 20; j < 50; ++j) image.power(30, j) *= 200.0f;
  }
  return images;
}

}  // namespace

TEST_CASE("one damaged pixel among many views is found and limited") {
  for (const float damage : {1e5f, 1e6f, 1e30f}) {
    std::vector<PosedImage> images = speckled_views(36, 1);
    float most = 0.0f;
    for (const PosedImage& image : images)
      for (const float p : image.power.pixels()) most = std::max(most, p);
    images[7].power(3, 5) = damage;
    const std::vector<Outlier> outliers = limit_outliers(images);
    REQUIRE(outliers.size() == 1);
    CHECK(outliers[0].image == 7);
    CHECK(outliers[0].i == 3);
    CHECK(outliers[0].j == 5);
    CHECK(outliers[0].power == damage);
    CHECK(outliers[0].limit == most);
    CHECK(images[7].power(3, 5) == most);
    CHECK(outlier_text(outliers[0], images).find("images/view_7.tif: pixel 3, 5 ") == 0);
    CHECK(limit_outliers(images).empty());
  }
}

TEST_CASE("an outlier does not hide behind a larger one") {
  std::vector<PosedImage> images = speckled_views(72, 2);
  images[7].power(3, 5) = 1e30f;
  images[8].power(9, 9) = 1e7f;
  CHECK(limit_outliers(images).size() == 2);
}

TEST_CASE("several damaged pixels are found, in one view or in a quarter of the views") {
  std::vector<PosedImage> images = speckled_views(36, 20);
  for (const std::size_t v : {3u, 9u, 17u, 30u}) images[v].power(static_cast<int>(v), 5) = 1e6f;
  CHECK(limit_outliers(images).size() == 4);
  images[3].power(1, 1) = images[3].power(1, 2) = 1e6f;
  images[3].power(2, 1) = 1e5f;
  images[9].power(9, 9) = 1e30f;
  CHECK(limit_outliers(images).size() == 4);
  CHECK(find_outliers(images).empty());
}

TEST_CASE("speckle, glints, flashes and points are no outliers") {
  for (unsigned seed = 3; seed < 13; ++seed) CHECK(find_outliers(speckled_views(36, seed)).empty());

  std::vector<PosedImage> flash = speckled_views(36, 14);  // a wall, in one view only
  for (int i = 10; i < 40; ++i) flash[4].power(i, 20) = 1e6f;
  CHECK(find_outliers(flash).empty());

  std::vector<PosedImage> point(36);  // a point over nothing, in all views
  for (PosedImage& image : point) {
    image.power = Image<float>(64, 64, 1e-3f);
    image.power(32, 32) = 1e3f;
  }
  CHECK(find_outliers(point).empty());

  std::vector<PosedImage> dark(36);  // nothing to compare with
  for (PosedImage& image : dark) image.power = Image<float>(8, 8);
  CHECK(find_outliers(dark).empty());
  dark[3].power(4, 4) = 1.0f;
  CHECK(find_outliers(dark).empty());

  std::vector<PosedImage> few = speckled_views(3, 15);
  few[0].power(1, 1) = 1e30f;
  CHECK(find_outliers(few).empty());
  CHECK(find_outliers({}).empty());
}
