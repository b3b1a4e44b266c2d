// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/background.h"

#include <algorithm>
#include <vector>

#include "sarnerf/core/looks.h"

namespace sarnerf {
namespace {

constexpr std::size_t kMostViews = 24;
constexpr double kFlattest = 0.9;       ///< quantile of a view's windows
constexpr double kSpeckledBelow = 50.0;  ///< looks

constexpr float kFaintest = 1e-8f;        ///< of the peak, that can be seen

bool most_exceed(std::span<const PosedImage> images, float power) {
  std::size_t n_above = 0, n = 0;
  for (const PosedImage& image : images) {
    n += image.power.pixels().size();
    for (const float p : image.power.pixels()) n_above += p > power;
  }
  return 2 * n_above > n;
}

}  // namespace

bool has_background(std::span<const PosedImage> images) { return most_exceed(images, 0.0f); }

bool has_visible_background(std::span<const PosedImage> images) {
  float peak = 0.0f;
  for (const PosedImage& image : images) {
    for (const float p : image.power.pixels()) peak = std::max(peak, p);
  }
  return most_exceed(images, kFaintest * peak);
}

std::optional<double> looks_of(std::span<const PosedImage> images) {
  if (!has_visible_background(images)) return std::nullopt;
  const LooksRule rule{.quantile = kFlattest};
  const std::size_t count = std::min(images.size(), kMostViews);
  std::vector<double> looks;
  for (std::size_t n = 0; n < count; ++n) {
    if (const auto value = equivalent_looks(images[n * images.size() / count].power, rule))
      looks.push_back(*value);
  }
  if (looks.empty()) return std::nullopt;
  const auto middle = looks.begin() + static_cast<std::ptrdiff_t>(looks.size() / 2);
  std::nth_element(looks.begin(), middle, looks.end());
  return *middle;
}

bool is_speckled(std::span<const PosedImage> images) {
  const auto looks = looks_of(images);
  return looks && *looks < kSpeckledBelow;
}

}  // namespace sarnerf
