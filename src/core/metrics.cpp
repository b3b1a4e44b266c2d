// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "same_size.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"

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
  // The smallest value that at least this share of the pixels does not exceed.
  const double rank = std::ceil(percentile / 100.0 * double(errors_db.size()));
  const auto nth = errors_db.begin() + static_cast<std::ptrdiff_t>(std::max(1.0, rank)) - 1;
  std::nth_element(errors_db.begin(), nth, errors_db.end());
  return *nth;
}

double psnr_db(const Image<float>& image, const Image<float>& reference, double peak) {
  require_same_size(image, reference);
  if (!(peak > 0.0)) {
    throw UsageError("the peak of a PSNR must be positive; it is " + std::to_string(peak));
  }
  const double mean = squared_difference(image, reference) / double(image.pixels().size());
  return mean == 0.0 ? kInfinity : 10.0 * std::log10(peak * peak / mean);
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

}  // namespace sarnerf
