// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/image_analysis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "image_checks.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

/// Blurs n pixels that lie `stride` apart.
void blur_line(const float* from, float* to, int n, std::ptrdiff_t stride,
               const std::vector<double>& weights) {
  const int reach = static_cast<int>(weights.size() / 2);
  for (int m = 0; m < n; ++m) {
    double sum = 0.0, weight = 0.0;
    for (int k = std::max(0, m - reach); k <= std::min(n - 1, m + reach); ++k) {
      const double w = weights[static_cast<std::size_t>(k - m + reach)];
      sum += w * double(from[stride * k]);
      weight += w;
    }
    to[stride * m] = static_cast<float>(sum / weight);
  }
}

}  // namespace

std::vector<double> gaussian_weights(std::size_t n, double sigma_pixels) {
  std::vector<double> weights(n);
  const double centre = 0.5 * (double(n) - 1.0);
  double sum = 0.0;
  for (std::size_t m = 0; m < n; ++m) {
    const double d = (double(m) - centre) / sigma_pixels;
    sum += weights[m] = std::exp(-0.5 * d * d);
  }
  for (double& w : weights) w /= sum;
  return weights;
}

Image<float> gaussian_blur(const Image<float>& image, double sigma_pixels) {
  if (!(sigma_pixels >= 0.0 && std::isfinite(sigma_pixels))) {
    throw UsageError("an image is blurred by a finite number of pixels, 0 or more; asked for " +
                     std::to_string(sigma_pixels));
  }
  if (sigma_pixels == 0.0 || image.pixels().empty()) return image;
  // A reach beyond the length of the image has no effect.
  const double longest = std::max(image.n_azimuth(), image.n_range());
  const auto reach = static_cast<std::size_t>(std::min(std::ceil(3.0 * sigma_pixels), longest));
  const std::vector<double> weights = gaussian_weights(2 * reach + 1, sigma_pixels);

  Image<float> along(image.n_azimuth(), image.n_range()), blurred = along;
  for (int i = 0; i < image.n_azimuth(); ++i)
    blur_line(&image(i, 0), &along(i, 0), image.n_range(), 1, weights);
  for (int j = 0; j < image.n_range(); ++j)
    blur_line(&along(0, j), &blurred(0, j), image.n_azimuth(), image.n_range(), weights);
  return blurred;
}

namespace {

SARNERF_CLONES void add_scaled(std::size_t n, double factor, const double* from, double* to) {
  for (std::size_t k = 0; k < n; ++k) to[k] += factor * from[k];
}

SARNERF_CLONES void add_scaled_row(std::size_t n, double factor, const float* from, double* to) {
  for (std::size_t k = 0; k < n; ++k) to[k] += factor * double(from[k]);
}

}  // namespace

void spread(double value, std::span<const double> taps, int j, std::span<double> row) {
  const int reach = static_cast<int>(taps.size() / 2);
  const int first = std::max(0, j - reach), end = std::min(static_cast<int>(row.size()), j + reach + 1);
  add_scaled(static_cast<std::size_t>(end - first), value, taps.data() + (first - j + reach),
             row.data() + first);
}

void gather_rows(const Plane& plane, std::span<const double> taps, int i, std::span<double> sum) {
  const int reach = static_cast<int>(taps.size() / 2);
  std::fill(sum.begin(), sum.end(), 0.0);
  const int last = std::min(plane.values.n_azimuth() - 1, i + reach);
  for (int from = std::max(0, i - reach); from <= last; ++from) {
    if (!plane.row_used[static_cast<std::size_t>(from)]) continue;
    add_scaled_row(sum.size(), taps[static_cast<std::size_t>(i - from + reach)],
                   plane.values.row(from).data(), sum.data());
  }
}

namespace {

bool exceeded(const Image<float>& image, int i, int j) {
  for (int a = std::max(0, i - 1); a <= std::min(image.n_azimuth() - 1, i + 1); ++a) {
    for (int b = std::max(0, j - 1); b <= std::min(image.n_range() - 1, j + 1); ++b)
      if (image(a, b) > image(i, j)) return true;
  }
  return false;
}

double distance_m(const LocalMaximum& a, const LocalMaximum& b, const MaximaRule& rule) {
  return std::hypot((a.i - b.i) * rule.azimuth_spacing_m, (a.j - b.j) * rule.range_spacing_m);
}

double nearest_m(const LocalMaximum& a, const std::vector<LocalMaximum>& others,
                 const MaximaRule& rule) {
  double nearest = distance_m(a, others.front(), rule);
  for (const LocalMaximum& b : others) nearest = std::min(nearest, distance_m(a, b, rule));
  return nearest;
}

void check(const MaximaRule& rule) {
  if (rule.most >= 1 && rule.separation_m >= 0.0 && rule.azimuth_spacing_m > 0.0 &&
      rule.range_spacing_m > 0.0) {
    return;
  }
  throw UsageError("expected at least 1 local maximum, positive pixel spacings and a separation of 0 or more");
}

}  // namespace

std::vector<LocalMaximum> strongest_maxima(const Image<float>& image, double floor,
                                           const MaximaRule& rule) {
  check(rule);
  std::vector<LocalMaximum> all;
  for (int i = 0; i < image.n_azimuth(); ++i) {
    for (int j = 0; j < image.n_range(); ++j) {
      if (double(image(i, j)) > floor && !exceeded(image, i, j)) all.push_back({i, j, image(i, j)});
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const LocalMaximum& a, const LocalMaximum& b) { return a.value > b.value; });
  std::vector<LocalMaximum> strongest;
  for (const LocalMaximum& m : all) {
    if (static_cast<int>(strongest.size()) == rule.most) break;
    if (strongest.empty() || nearest_m(m, strongest, rule) >= rule.separation_m)
      strongest.push_back(m);
  }
  return strongest;
}

double mean_distance_m(const std::vector<LocalMaximum>& reference,
                       const std::vector<LocalMaximum>& others, const MaximaRule& rule) {
  if (reference.empty() || others.empty())
    throw UsageError("a mean distance needs at least one local maximum in each image");
  double sum_m = 0.0;
  for (const LocalMaximum& m : reference) sum_m += nearest_m(m, others, rule);
  return sum_m / double(reference.size());
}

std::optional<Regions> find_regions(const Image<float>& power, const RegionRule& rule) {
  if (!(rule.target_db > 0.0 && rule.shadow_db > 0.0)) {
    throw UsageError("thresholds of target and shadow must be above 0 dB; the rule has " +
                     format("%.6g and %.6g", rule.target_db, rule.shadow_db));
  }
  if (power.pixels().empty()) return std::nullopt;
  const Image<float> blurred = gaussian_blur(power, rule.blur_pixels);
  Regions regions;
  regions.background_power = double(median(std::vector<float>(blurred.pixels().begin(), blurred.pixels().end())));
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

Image<std::uint8_t> connected_to_middle(const Image<std::uint8_t>& mask, int reach_pixels) {
  Image<std::uint8_t> connected(mask.n_azimuth(), mask.n_range());
  std::vector<std::pair<int, int>> open;
  const auto offer = [&](int i, int j) {
    if (i < 0 || j < 0 || i >= mask.n_azimuth() || j >= mask.n_range() || mask(i, j) == 0 || connected(i, j) != 0) return;
    connected(i, j) = 1;
    open.emplace_back(i, j);
  };
  const int middle_i = mask.n_azimuth() / 2, middle_j = mask.n_range() / 2;
  for (int i = middle_i - reach_pixels; i <= middle_i + reach_pixels; ++i)
    for (int j = middle_j - reach_pixels; j <= middle_j + reach_pixels; ++j) offer(i, j);
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    for (const auto& [di, dj] : {std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)}) offer(i + di, j + dj);
  }
  return connected;
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

namespace {

using Mask = Image<std::uint8_t>;

/// Dilates one line of n pixels, `stride` apart, by `reach` to both sides: a forward and a backward pass measure the
/// distance to the target pixel before and after each pixel.
void dilate_line(std::uint8_t* first, int n, std::ptrdiff_t stride, int reach) {
  // 2 marks added pixels, from which the target is not dilated further.
  for (const bool forwards : {true, false}) {
    int since = std::numeric_limits<int>::max();
    for (int m = 0; m < n; ++m) {
      std::uint8_t& pixel = first[stride * (forwards ? m : n - 1 - m)];
      if (pixel == 1) {
        since = 0;
      } else if (since < reach) {
        ++since;
        pixel = 2;
      } else {
        since = std::numeric_limits<int>::max();
      }
    }
  }
  for (int m = 0; m < n; ++m) first[stride * m] = first[stride * m] != 0;
}

}  // namespace

Mask target_mask(const Image<float>& reference, const TargetRule& rule) {
  if (!(rule.share_of_peak >= 0.0 && rule.share_of_peak < 1.0)) {
    throw UsageError("the target's share of the peak lies in [0, 1); it is " +
                     std::to_string(rule.share_of_peak));
  }
  if (rule.dilation_pixels < 0) {
    throw UsageError("a target cannot be dilated by " + std::to_string(rule.dilation_pixels) +
                     " pixels; 0 leaves it as it is");
  }
  float peak = 0.0f;
  for (const float p : reference.pixels()) peak = std::max(peak, p);
  const double floor = double(peak) * rule.share_of_peak;

  Mask mask(reference.n_azimuth(), reference.n_range());
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    mask.pixels()[n] = double(reference.pixels()[n]) > floor;
  }
  if (mask.pixels().empty()) return mask;
  for (int i = 0; i < mask.n_azimuth(); ++i) {
    dilate_line(&mask(i, 0), mask.n_range(), 1, rule.dilation_pixels);
  }
  for (int j = 0; j < mask.n_range(); ++j) {
    dilate_line(&mask(0, j), mask.n_azimuth(), mask.n_range(), rule.dilation_pixels);
  }
  return mask;
}

std::optional<double> masked_psnr_db(const Image<float>& image, const Image<float>& reference,
                                     double peak, const Mask& mask) {
  require_same_size(image, reference);
  require_same_size(mask, reference);
  if (!(peak > 0.0)) {
    throw UsageError("the peak of a PSNR must be positive; it is " + std::to_string(peak));
  }
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t n = 0; n < mask.pixels().size(); ++n) {
    if (mask.pixels()[n] == 0) continue;
    const double d = double(image.pixels()[n]) - double(reference.pixels()[n]);
    sum += d * d;
    ++count;
  }
  if (count == 0) return std::nullopt;
  if (sum == 0.0) return std::numeric_limits<double>::infinity();
  return 10.0 * std::log10(peak * peak * double(count) / sum);
}

}  // namespace sarnerf
