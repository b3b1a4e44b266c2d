// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/formation/clutter.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <random>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

constexpr std::size_t kLeastPixels = 100;

double sum_of_fourth_powers(const std::vector<double>& taps) {
  double sum = 0.0;
  for (const double h : taps) sum += h * h * h * h;
  return sum;
}

/// Autocorrelation of power of neighbours under the response of this resolution, on texture of variance v, for one look.
double neighbour_correlation(const Window& window, double resolution_m, double spacing_m, double v) {
  const std::vector<double> taps = make_kernel(window, resolution_m, spacing_m).taps;
  double amplitudes = 0.0, powers = 0.0;
  for (std::size_t n = 0; n + 1 < taps.size(); ++n) {
    const double product = taps[n] * taps[n + 1];
    amplitudes += product;
    powers += product * product;
  }
  const double speckle = amplitudes * amplitudes, texture = v * powers / sum_of_fourth_powers(taps);
  return (speckle + 2.0 * texture) / (1.0 + 2.0 * v);
}

/// The resolution (m) whose neighbours have this correlation; nothing if the narrowest possible one has more.
std::optional<double> resolution_of(double correlation, const Window& window, double spacing_m, double v) {
  constexpr int kHalvings = 40;
  constexpr double kWidest_pixels = 20.0;
  // A band of 1 / spacing: wider ones are aliased.
  double low = Taper(window).broadening() * spacing_m * (1.0 + 1e-9), high = kWidest_pixels * spacing_m;
  if (correlation <= neighbour_correlation(window, low, spacing_m, v)) return std::nullopt;
  for (int n = 0; n < kHalvings; ++n) {
    const double middle = 0.5 * (low + high);
    (neighbour_correlation(window, middle, spacing_m, v) < correlation ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

void ClutterSums::Products::add(const Products& other) {
  sum += other.sum;
  n += other.n;
}

void ClutterSums::add_background(const Image<float>& power, const Image<std::uint8_t>& background) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t k = 0; k < background.pixels().size(); ++k)
    if (background.pixels()[k] != 0) {
      sum += double{power.pixels()[k]};
      ++n;
    }
  if (n < kLeastPixels || !(sum > 0.0)) return;
  n_pixels_ += n;
  const double mean = sum / static_cast<double>(n);
  const auto deviation = [&](int i, int j) { return double{power(i, j)} / mean - 1.0; };
  for (int i = 0; i < power.n_azimuth(); ++i)
    for (int j = 0; j < power.n_range(); ++j) {
      if (background(i, j) == 0) continue;
      const double d = deviation(i, j);
      variance_.add({d * d, 1.0});
      for (int lag = 1; lag <= ClutterStatistics::kLags; ++lag) {
        const auto at = static_cast<std::size_t>(lag - 1);
        if (i + lag < power.n_azimuth() && background(i + lag, j) != 0) azimuth_[at].add({d * deviation(i + lag, j), 1.0});
        if (j + lag < power.n_range() && background(i, j + lag) != 0) range_[at].add({d * deviation(i, j + lag), 1.0});
      }
    }
}

void ClutterSums::add(const Image<float>& power) {
  if (const auto regions = find_regions(power)) add_background(power, regions->background);
}

void ClutterSums::add(const Image<float>& power, const Image<std::uint8_t>& hidden) {
  if (hidden.n_azimuth() != power.n_azimuth() || hidden.n_range() != power.n_range())
    throw UsageError(format("statistics of clutter: expected a mask of %d x %d pixels, found %d x %d", power.n_azimuth(), power.n_range(),
                            hidden.n_azimuth(), hidden.n_range()));
  auto regions = find_regions(power);
  if (!regions) return;
  for (std::size_t k = 0; k < hidden.pixels().size(); ++k)
    if (hidden.pixels()[k] != 0) regions->background.pixels()[k] = 0;
  add_background(power, regions->background);
}

void ClutterSums::add(const ClutterSums& other) {
  variance_.add(other.variance_);
  for (std::size_t lag = 0; lag < ClutterStatistics::kLags; ++lag) {
    azimuth_[lag].add(other.azimuth_[lag]);
    range_[lag].add(other.range_[lag]);
  }
  n_pixels_ += other.n_pixels_;
}

std::optional<ClutterStatistics> ClutterSums::statistics() const {
  const double variance = variance_.mean();
  if (n_pixels_ == 0 || !(variance > 0.0)) return std::nullopt;
  ClutterStatistics result;
  result.looks = 1.0 / variance;
  result.n_pixels = n_pixels_;
  for (std::size_t lag = 0; lag < ClutterStatistics::kLags; ++lag) {
    result.azimuth[lag] = azimuth_[lag].mean() / variance;
    result.range[lag] = range_[lag].mean() / variance;
  }
  return result;
}

std::optional<ClutterStatistics> clutter_statistics(std::span<const Image<float>> powers) {
  ClutterSums sums;
  for (const Image<float>& power : powers) sums.add(power);
  return sums.statistics();
}

std::optional<ClutterModel> fitted_clutter(std::span<const Image<float>> powers, const Window& window, double azimuth_spacing_m,
                                           double range_spacing_m) {
  constexpr double kMostLooks = 1000.0;
  const auto clutter = clutter_statistics(powers);
  if (!clutter) return std::nullopt;
  ClutterModel model;
  model.radar.looks = std::clamp(clutter->looks, 1.0, kMostLooks);
  model.texture_variance = std::max(0.0, 0.5 * (1.0 + 1.0 / clutter->looks) - 1.0);
  const auto azimuth_m = resolution_of(clutter->azimuth.front(), window, azimuth_spacing_m, model.texture_variance),
             range_m = resolution_of(clutter->range.front(), window, range_spacing_m, model.texture_variance);
  if (azimuth_m && range_m) {
    model.radar.resolution_m = {*azimuth_m, *range_m};
    model.radar.window = window;
  }
  return model;
}

void multiply_by_texture(Image<float>& reflectivity, const ClutterModel& clutter, const Acquisition& acquisition) {
  if (!(clutter.texture_variance > 0.0)) return;
  const ImpulseResponse response = impulse_response(clutter.radar, acquisition.azimuth_spacing_m, acquisition.range_spacing_m);
  const double variance =
      clutter.texture_variance / (sum_of_fourth_powers(response.azimuth.taps) * sum_of_fourth_powers(response.range.taps));
  // Each view has a texture of its own: the model is of one look at one pose, not of the ground.
  const auto azimuth = std::bit_cast<std::uint64_t>(acquisition.azimuth_rad), incidence = std::bit_cast<std::uint64_t>(acquisition.incidence_rad);
  std::seed_seq seed{clutter.radar.seed, clutter.radar.seed >> 32, azimuth, azimuth >> 32, incidence, incidence >> 32};
  std::mt19937_64 random(seed);
  std::gamma_distribution<double> tau(1.0 / variance, variance);
  for (float& p : reflectivity.pixels()) p = static_cast<float>(double{p} * tau(random));
}

void multiply_by_clutter(Image<float>& mean_power, const ClutterModel& clutter, const Acquisition& acquisition) {
  if (!clutter.radar.speckle()) return;
  const Border border = border_of(impulse_response(clutter.radar, acquisition.azimuth_spacing_m, acquisition.range_spacing_m),
                                  acquisition.n_azimuth, acquisition.n_range);
  const Acquisition wide = widened(acquisition, border);
  ImageFormation without_noise = clutter.radar;
  without_noise.nesz_db.reset();
  Image<float> factor(wide.n_azimuth, wide.n_range, 1.0f);
  multiply_by_texture(factor, clutter, wide);
  form_image(factor, without_noise, wide, 0.0);
  factor = without_border(std::move(factor), border);
  for (std::size_t n = 0; n < factor.pixels().size(); ++n) mean_power.pixels()[n] *= factor.pixels()[n];
}

}  // namespace sarnerf
