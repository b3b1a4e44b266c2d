// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/display.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "codec.h"

namespace sarnerf {

float white_level(const Image<float>& image, const DisplayRange& range) {
  std::vector<float> positive;
  positive.reserve(image.pixels().size());
  for (const float p : image.pixels()) {
    if (p > 0.0f) positive.push_back(p);
  }
  if (positive.empty()) return 0.0f;
  const double rank = std::ceil(range.percentile / 100.0 * double(positive.size()));
  const auto last = static_cast<std::ptrdiff_t>(positive.size()) - 1;
  const auto nth =
      positive.begin() + std::clamp(static_cast<std::ptrdiff_t>(rank) - 1, std::ptrdiff_t{0}, last);
  std::nth_element(positive.begin(), nth, positive.end());
  return *nth;
}

double level_db(float level, Quantity quantity) {
  return (quantity == Quantity::power ? 10.0 : 20.0) * std::log10(double(level));
}

Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity,
                                   const DisplayRange& range) {
  return display_levels(image, quantity, white_level(image, range), range);
}

Image<std::uint8_t> display_levels(const Image<float>& image, Quantity quantity, float white,
                                   const DisplayRange& range) {
  Image<std::uint8_t> levels(image.n_azimuth(), image.n_range(), 0);
  if (!(white > 0.0f)) return levels;
  const float db_per_decade = quantity == Quantity::power ? 10.0f : 20.0f;
  const float levels_per_decade = db_per_decade * 255.0f / static_cast<float>(range.range_db);
  for (std::size_t n = 0; n < image.pixels().size(); ++n) {
    const float p = image.pixels()[n];
    if (!(p > 0.0f)) continue;
    const float level = 255.0f + levels_per_decade * std::log10(p / white);
    levels.pixels()[n] = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0f, 255.0f)));
  }
  return levels;
}

std::vector<std::byte> encode_png(const Image<std::uint8_t>& levels) {
  const cv::Mat mat(levels.n_azimuth(), levels.n_range(), CV_8UC1,
                    const_cast<std::uint8_t*>(levels.pixels().data()));
  // Level 1 with run lengths takes a fifth of the default's time; shadow and background still vanish.
  return encode(".png", mat,
                {cv::IMWRITE_PNG_COMPRESSION, 1, cv::IMWRITE_PNG_STRATEGY,
                 cv::IMWRITE_PNG_STRATEGY_RLE});
}

}  // namespace sarnerf
