// SPDX-License-Identifier: Apache-2.0
#include "display_scale.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sarnerf/dataset/display.h"

namespace sarnerf::app {
namespace {

constexpr std::size_t kMostSamples = 9;

}  // namespace

std::vector<std::size_t> DisplayScale::sample_views(std::size_t n_views) {
  const std::size_t n_samples = std::min(n_views, kMostSamples);
  std::vector<std::size_t> views(n_samples);
  for (std::size_t n = 0; n < n_samples; ++n) views[n] = n * n_views / n_samples;
  return views;
}

DisplayScale::DisplayScale(std::span<const float> white_levels) {
  std::vector<float> levels;
  std::copy_if(white_levels.begin(), white_levels.end(), std::back_inserter(levels),
               [](float level) { return level > 0.0f; });
  if (levels.empty()) return;
  const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
  std::nth_element(levels.begin(), middle, levels.end());
  white_ = *middle;
}

float DisplayScale::white_for(const Image<float>& image) const {
  return white_ ? *white_ : white_level(image);
}

Json DisplayScale::text(Quantity quantity) const {
  if (!white_) return "blank";
  // A hundredth of a decibel is finer than a grey level.
  const double white_db = std::round(100.0 * level_db(*white_, quantity)) / 100.0;
  return {{"white_db", white_db}, {"black_db", white_db - DisplayRange{}.range_db}};
}

std::vector<std::byte> make_picture(const Image<float>& image, Quantity quantity, const DisplayScale& scale) {
  return encode_png(display_levels(image, quantity, scale.white_for(image)));
}

}  // namespace sarnerf::app
