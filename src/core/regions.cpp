// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/regions.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "same_size.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/gaussian_blur.h"

namespace sarnerf {
namespace {

double median(std::span<const float> pixels) {
  std::vector<float> values(pixels.begin(), pixels.end());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return double(*middle);
}

}  // namespace

std::optional<Regions> find_regions(const Image<float>& power, const RegionRule& rule) {
  if (!(rule.target_db > 0.0 && rule.shadow_db > 0.0)) {
    throw UsageError("target and shadow lie some decibels above and below the background; the rule says " +
                     format("%.6g and %.6g", rule.target_db, rule.shadow_db));
  }
  if (power.pixels().empty()) return std::nullopt;
  const Image<float> blurred = gaussian_blur(power, rule.blur_pixels);
  Regions regions;
  regions.background_power = median(blurred.pixels());
  if (!(regions.background_power > 0.0)) return std::nullopt;
  const double bright = regions.background_power * std::pow(10.0, 0.1 * rule.target_db);
  const double dark = regions.background_power * std::pow(10.0, -0.1 * rule.shadow_db);

  regions.target = Image<std::uint8_t>(power.n_azimuth(), power.n_range());
  regions.shadow = regions.background = regions.target;
  for (std::size_t n = 0; n < blurred.pixels().size(); ++n) {
    const double p = double(blurred.pixels()[n]);
    regions.target.pixels()[n] = p > bright;
    regions.shadow.pixels()[n] = p < dark;
    regions.background.pixels()[n] = p <= bright && p >= dark;
  }
  return regions;
}

std::optional<double> intersection_over_union(const Image<std::uint8_t>& a,
                                              const Image<std::uint8_t>& b) {
  require_same_size(a, b);
  std::size_t both = 0, either = 0;
  for (std::size_t n = 0; n < a.pixels().size(); ++n) {
    both += a.pixels()[n] != 0 && b.pixels()[n] != 0;
    either += a.pixels()[n] != 0 || b.pixels()[n] != 0;
  }
  if (either == 0) return std::nullopt;
  return double(both) / double(either);
}

}  // namespace sarnerf
