// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "image_checks.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/text.h"

namespace sarnerf {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double squared_difference(const Image<float>& image, const Image<float>& reference) {
  double sum = 0.0;
  for (std::size_t n = 0; n < image.pixels().size(); ++n) {
    const double d = double(image.pixels()[n]) - double(reference.pixels()[n]);
    sum += d * d;
  }
  return sum;
}

}  // namespace

double relative_l2_error(const Image<float>& image, const Image<float>& reference) {
  require_same_size(image, reference);
  double norm = 0.0;
  for (const float p : reference.pixels()) norm += double(p) * double(p);
  const double difference = squared_difference(image, reference);
  if (norm == 0.0) return difference == 0.0 ? 0.0 : kInfinity;
  return std::sqrt(difference / norm);
}

double db_error_percentile(const Image<float>& image, const Image<float>& reference,
                           double percentile, double range_db) {
  require_same_size(image, reference);
  if (!(percentile >= 0.0 && percentile <= 100.0)) {
    throw UsageError("a percentile lies between 0 and 100; it is " + std::to_string(percentile));
  }
  float peak = 0.0f;
  for (const float p : reference.pixels()) peak = std::max(peak, p);
  const double floor = double(peak) * std::pow(10.0, -range_db / 10.0);
  std::vector<double> errors_db;
  for (std::size_t n = 0; n < reference.pixels().size(); ++n) {
    const double expected = reference.pixels()[n];
    if (expected <= 0.0 || expected < floor) continue;
    const double found = image.pixels()[n];
    errors_db.push_back(found > 0.0 ? std::abs(10.0 * std::log10(found / expected)) : kInfinity);
  }
  if (errors_db.empty()) return 0.0;
  return quantile_reached(errors_db, percentile / 100.0);
}

double psnr_db(const Image<float>& image, const Image<float>& reference, double peak) {
  require_same_size(image, reference);
  if (!(peak > 0.0)) {
    throw UsageError("the peak of a PSNR must be positive; it is " + std::to_string(peak));
  }
  const double mean = squared_difference(image, reference) / double(image.pixels().size());
  return mean == 0.0 ? kInfinity : 10.0 * std::log10(peak * peak / mean);
}

double capped_psnr_db(const Image<float>& image, const Image<float>& reference, double peak) {
  return std::min(psnr_db(image, reference, peak), kMostPsnr_db);
}

double log_amplitude_error_db(const Image<float>& power, const Image<float>& reference, double peak,
                              double range_db) {
  require_same_size(power, reference);
  if (power.pixels().empty()) throw UsageError("images without pixels have no error");
  if (!(peak > 0.0 && range_db > 0.0)) {
    throw UsageError("decibels below a peak need a positive peak and range; they are " +
                     format("%.6g and %.6g dB", peak, range_db));
  }
  const double floor = std::pow(10.0, -0.1 * range_db);
  const auto level_db = [&](float p) { return 10.0 * std::log10(std::max(double(p) / peak, floor)); };
  double sum = 0.0;
  for (std::size_t n = 0; n < power.pixels().size(); ++n) {
    const double d = level_db(power.pixels()[n]) - level_db(reference.pixels()[n]);
    sum += d * d;
  }
  return std::sqrt(sum / double(power.pixels().size()));
}

namespace {

constexpr int kWindow = 11;
constexpr double kSigma_pixels = 1.5;

/// Weighted means over a window of x, y, x², y² and xy, with x the image and y the reference.
struct Moments {
  double x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;

  void add(double weight, const Moments& m) {
    x += weight * m.x;
    y += weight * m.y;
    xx += weight * m.xx;
    yy += weight * m.yy;
    xy += weight * m.xy;
  }
};

Moments of_pixel(double x, double y) { return {x, y, x * x, y * y, x * y}; }

/// Weights along a side of n pixels.
std::vector<double> window_weights(int n) {
  return gaussian_weights(static_cast<std::size_t>(std::min(n, kWindow)), kSigma_pixels);
}

double similarity(const Moments& m, double c1, double c2) {
  const double xx = m.xx - m.x * m.x, yy = m.yy - m.y * m.y, xy = m.xy - m.x * m.y;
  return (2.0 * m.x * m.y + c1) * (2.0 * xy + c2) / ((m.x * m.x + m.y * m.y + c1) * (xx + yy + c2));
}

}  // namespace

double ssim(const Image<float>& image, const Image<float>& reference, double peak) {
  require_same_size(image, reference);
  if (image.pixels().empty()) throw UsageError("images without pixels have no similarity");
  if (!(peak > 0.0 && std::isfinite(peak))) {
    throw UsageError("the peak of an SSIM must be positive and finite; it is " +
                     std::to_string(peak));
  }
  const double c1 = 0.01 * peak * (0.01 * peak), c2 = 0.03 * peak * (0.03 * peak);
  const std::vector<double> down = window_weights(image.n_azimuth()),
                            along = window_weights(image.n_range());
  const int n_i = image.n_azimuth() - static_cast<int>(down.size()) + 1;
  const int n_j = image.n_range() - static_cast<int>(along.size()) + 1;

  double sum = 0.0;
  std::vector<Moments> columns(static_cast<std::size_t>(image.n_range()));
  for (int i = 0; i < n_i; ++i) {
    std::fill(columns.begin(), columns.end(), Moments{});
    for (std::size_t m = 0; m < down.size(); ++m) {
      const auto x = image.row(i + static_cast<int>(m)), y = reference.row(i + static_cast<int>(m));
      for (std::size_t j = 0; j < columns.size(); ++j)
        columns[j].add(down[m], of_pixel(x[j], y[j]));
    }
    for (std::size_t j = 0; j < static_cast<std::size_t>(n_j); ++j) {
      Moments window;
      for (std::size_t m = 0; m < along.size(); ++m) window.add(along[m], columns[j + m]);
      sum += similarity(window, c1, c2);
    }
  }
  return sum / (double(n_i) * double(n_j));
}

namespace {

void check(const LooksRule& rule) {
  if (rule.window_pixels >= 2 && rule.step_pixels >= 1 && rule.quantile >= 0.0 &&
      rule.quantile <= 1.0) {
    return;
  }
  throw UsageError("looks are counted in windows of 2 or more pixels, 1 or more apart, at a quantile "
                   "in [0, 1]; the rule says " +
                   std::to_string(rule.window_pixels) + ", " + std::to_string(rule.step_pixels) +
                   ", " + std::to_string(rule.quantile));
}

bool all_set(const Image<std::uint8_t>& mask, int i0, int j0, int side) {
  for (int i = i0; i < i0 + side; ++i) {
    const auto row = mask.row(i).subspan(static_cast<std::size_t>(j0), static_cast<std::size_t>(side));
    if (std::find(row.begin(), row.end(), std::uint8_t{0}) != row.end()) return false;
  }
  return true;
}

/// Looks of one window; empty for a window without power.
std::optional<double> looks_of_window(const Image<float>& power, int i0, int j0, int side) {
  // Sums are relative to the first pixel: in a nearly flat window, rounding of the plain sum of squares would exceed the
  // variance.
  const double origin = double(power(i0, j0));
  double sum = 0.0, squares = 0.0;
  for (int i = i0; i < i0 + side; ++i) {
    for (int j = j0; j < j0 + side; ++j) {
      const double d = double(power(i, j)) - origin;
      sum += d;
      squares += d * d;
    }
  }
  const double n = double(side) * side, mean = origin + sum / n;
  if (!(mean > 0.0)) return std::nullopt;
  const double variance = (squares - sum * sum / n) / (n - 1.0);
  return mean * mean > kMostLooks * variance ? kMostLooks : mean * mean / variance;
}

}  // namespace

std::optional<double> equivalent_looks(const Image<float>& power, const LooksRule& rule,
                                       const Image<std::uint8_t>* only) {
  check(rule);
  if (only != nullptr) require_same_size(*only, power);
  const int side = rule.window_pixels;
  std::vector<double> looks;
  for (int i = 0; i + side <= power.n_azimuth(); i += rule.step_pixels) {
    for (int j = 0; j + side <= power.n_range(); j += rule.step_pixels) {
      if (only != nullptr && !all_set(*only, i, j, side)) continue;
      if (const auto value = looks_of_window(power, i, j, side)) looks.push_back(*value);
    }
  }
  if (looks.empty()) return std::nullopt;
  return quantile_below(looks, rule.quantile);
}

}  // namespace sarnerf
