// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/formation/clutter.h"

#include <algorithm>
#include <vector>

#include "sarnerf/core/image_analysis.h"

namespace sarnerf {

namespace {

constexpr std::size_t kLeastPixels = 100;

/// Sum of products of two deviations, and their number.
struct Products {
  double sum = 0.0, n = 0.0;

  void add(double product) {
    sum += product;
    n += 1.0;
  }
  double mean() const { return n > 0.0 ? sum / n : 0.0; }
};

struct Sums {
  Products variance;
  std::array<Products, ClutterStatistics::kLags> azimuth, range;
  std::size_t n_pixels = 0;
};

void add_image(const Image<float>& power, const Image<std::uint8_t>& mask, Sums& sums) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t k = 0; k < mask.pixels().size(); ++k)
    if (mask.pixels()[k] != 0) {
      sum += double{power.pixels()[k]};
      ++n;
    }
  if (n < kLeastPixels || !(sum > 0.0)) return;
  sums.n_pixels += n;
  const double mean = sum / static_cast<double>(n);
  const auto deviation = [&](int i, int j) { return double{power(i, j)} / mean - 1.0; };
  for (int i = 0; i < power.n_azimuth(); ++i)
    for (int j = 0; j < power.n_range(); ++j) {
      if (mask(i, j) == 0) continue;
      const double d = deviation(i, j);
      sums.variance.add(d * d);
      for (int lag = 1; lag <= ClutterStatistics::kLags; ++lag) {
        const auto at = static_cast<std::size_t>(lag - 1);
        if (i + lag < power.n_azimuth() && mask(i + lag, j) != 0) sums.azimuth[at].add(d * deviation(i + lag, j));
        if (j + lag < power.n_range() && mask(i, j + lag) != 0) sums.range[at].add(d * deviation(i, j + lag));
      }
    }
}

/// Autocorrelation of power of neighbours under the response of this resolution.
double neighbour_correlation(const Window& window, double resolution_m, double spacing_m) {
  const std::vector<double> taps = make_kernel(window, resolution_m, spacing_m).taps;
  double sum = 0.0;
  for (std::size_t n = 0; n + 1 < taps.size(); ++n) sum += taps[n] * taps[n + 1];
  return sum * sum;
}

/// The resolution (m) whose neighbours have this correlation; nothing if the narrowest possible one has more.
std::optional<double> resolution_of(double correlation, const Window& window, double spacing_m) {
  constexpr int kHalvings = 40;
  constexpr double kWidest_pixels = 20.0;
  // A band of 1 / spacing: wider ones are aliased.
  double low = Taper(window).broadening() * spacing_m * (1.0 + 1e-9), high = kWidest_pixels * spacing_m;
  if (correlation <= neighbour_correlation(window, low, spacing_m)) return std::nullopt;
  for (int n = 0; n < kHalvings; ++n) {
    const double middle = 0.5 * (low + high);
    (neighbour_correlation(window, middle, spacing_m) < correlation ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

std::optional<ClutterStatistics> clutter_statistics(std::span<const Image<float>> powers) {
  Sums sums;
  for (const Image<float>& power : powers)
    if (const auto regions = find_regions(power)) add_image(power, regions->background, sums);
  const double variance = sums.variance.mean();
  if (sums.n_pixels == 0 || !(variance > 0.0)) return std::nullopt;
  ClutterStatistics result;
  result.looks = 1.0 / variance;
  result.n_pixels = sums.n_pixels;
  for (std::size_t lag = 0; lag < ClutterStatistics::kLags; ++lag) {
    result.azimuth[lag] = sums.azimuth[lag].mean() / variance;
    result.range[lag] = sums.range[lag].mean() / variance;
  }
  return result;
}

std::optional<Resolution> fitted_resolution(const ClutterStatistics& clutter, const Window& window, double azimuth_spacing_m,
                                            double range_spacing_m) {
  const auto azimuth_m = resolution_of(clutter.azimuth.front(), window, azimuth_spacing_m),
             range_m = resolution_of(clutter.range.front(), window, range_spacing_m);
  if (!azimuth_m || !range_m) return std::nullopt;
  return Resolution{*azimuth_m, *range_m, window};
}

std::optional<ImageFormation> fitted_speckle(std::span<const Image<float>> powers, const Window& window, double azimuth_spacing_m,
                                             double range_spacing_m) {
  const auto clutter = clutter_statistics(powers);
  if (!clutter) return std::nullopt;
  ImageFormation formation;
  formation.looks = std::clamp(clutter->looks, 1.0, 1000.0);
  if (const auto resolution = fitted_resolution(*clutter, window, azimuth_spacing_m, range_spacing_m)) {
    formation.resolution_m = {resolution->azimuth_m, resolution->range_m};
    formation.window = resolution->window;
  }
  return formation;
}

void multiply_by_speckle(Image<float>& mean_power, const ImageFormation& formation, const Acquisition& acquisition) {
  if (!formation.speckle()) return;
  const Border border = border_of(impulse_response(formation, acquisition.azimuth_spacing_m, acquisition.range_spacing_m),
                                  acquisition.n_azimuth, acquisition.n_range);
  const Acquisition wide = widened(acquisition, border);
  ImageFormation without_noise = formation;
  without_noise.nesz_db.reset();
  Image<float> clutter(wide.n_azimuth, wide.n_range, 1.0f);
  form_image(clutter, without_noise, wide, 0.0);
  clutter = without_border(std::move(clutter), border);
  for (std::size_t n = 0; n < clutter.pixels().size(); ++n) mean_power.pixels()[n] *= clutter.pixels()[n];
}

}  // namespace sarnerf
