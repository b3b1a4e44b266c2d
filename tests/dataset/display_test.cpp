// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_file.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "catch.h"

using namespace sarnerf;

TEST_CASE("grey falls linearly with decibels, whatever the scale and the quantity") {
  // Whole decibels from 0 down to −99, brightest last; with 100 pixels the percentile is the maximum.
  for (const float scale : {1e-6f, 1.0f, 1e9f}) {
    Image<float> power(1, 100), amplitude(1, 100);
    for (int j = 0; j < 100; ++j) {
      power(0, j) = scale * std::pow(10.0f, 0.1f * float(j - 99));
      amplitude(0, j) = std::sqrt(power(0, j));
    }
    const auto levels = display_levels(power, Quantity::power);
    for (int j = 0; j < 100; ++j) {
      const double expected = std::max(0.0, 255.0 * (1.0 - (99 - j) / 40.0));
      CHECK(std::abs(levels(0, j) - expected) <= 0.51);
    }
    const auto same = display_levels(amplitude, Quantity::amplitude);
    for (int j = 0; j < 100; ++j) CHECK(std::abs(levels(0, j) - same(0, j)) <= 1);
  }
}

TEST_CASE("one glint in a thousand does not darken the picture, nor do empty pixels") {
  Image<float> image(40, 100, 0.0f);
  for (int j = 0; j < 100; ++j) {
    for (int i = 0; i < 20; ++i) image(i, j) = 1.0f;
  }
  image(3, 3) = 1e6f;
  const auto levels = display_levels(image, Quantity::power);
  CHECK(levels(0, 0) == 255);
  CHECK(levels(3, 3) == 255);
  CHECK(levels(30, 3) == 0);
}

TEST_CASE("pictures with one white level keep the ratios between images") {
  Image<float> bright(10, 10, 2.0f), dark(10, 10, 0.02f);
  CHECK(white_level(bright) == 2.0f);
  CHECK(level_db(2.0f, Quantity::power) == Approx(3.0103));
  CHECK(level_db(2.0f, Quantity::amplitude) == Approx(6.0206));
  CHECK(display_levels(dark, Quantity::power)(0, 0) == 255);
  // 20 dB below white: half of the 40 dB.
  CHECK(std::abs(display_levels(dark, Quantity::power, 2.0f)(0, 0) - 127.5) <= 0.51);
  CHECK(display_levels(bright, Quantity::power, 0.02f)(0, 0) == 255);
  CHECK(display_levels(bright, Quantity::power, 0.0f)(0, 0) == 0);
}

TEST_CASE("blank and negative pixels are black") {
  CHECK(display_levels(Image<float>(2, 2, 0.0f), Quantity::power)(1, 1) == 0);
  CHECK(display_levels(Image<float>(2, 2, -1.0f), Quantity::power)(1, 1) == 0);
}

TEST_CASE("a PNG keeps the levels, row 0 on top") {
  Image<std::uint8_t> levels(3, 5);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 5; ++j) levels(i, j) = std::uint8_t(50 * i + j);
  }
  const auto bytes = encode_png(levels);
  const cv::Mat back = cv::imdecode(
      cv::Mat(1, int(bytes.size()), CV_8UC1, const_cast<std::byte*>(bytes.data())),
      cv::IMREAD_UNCHANGED);
  REQUIRE(back.type() == CV_8UC1);
  REQUIRE(back.rows == 3);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 5; ++j) CHECK(back.at<std::uint8_t>(i, j) == levels(i, j));
  }
}
