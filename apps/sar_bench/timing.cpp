// SPDX-License-Identifier: Apache-2.0
#include "timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace sarnerf::bench {
namespace {

/// Four significant digits: more would be noise.
double rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return std::strtod(text, nullptr);
}

nlohmann::json spread(const Timing& t, double factor) {
  return {{"median", rounded(t.median() * factor)},
          {"quartiles", {rounded(t.quantile(0.25) * factor), rounded(t.quantile(0.75) * factor)}},
          {"runs", t.seconds.size()}};
}

Timing ratios(const Timing& a, const Timing& b) {
  Timing of_pairs;
  for (std::size_t n = 0; n < a.seconds.size(); ++n) of_pairs.seconds.push_back(a.seconds[n] / b.seconds[n]);
  return of_pairs;
}

}  // namespace

double Timing::quantile(double q) const {
  std::vector<double> sorted = seconds;
  std::sort(sorted.begin(), sorted.end());
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], position - std::floor(position));
}

std::vector<Timing> run_in_turn(const std::vector<std::function<void()>>& contenders, int rounds) {
  std::vector<Timing> timings(contenders.size());
  for (int round = -1; round < rounds; ++round) {
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      const auto start = std::chrono::steady_clock::now();
      contenders[c]();
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      if (round >= 0) timings[c].seconds.push_back(elapsed.count());
    }
  }
  return timings;
}

double ratio(const Timing& a, const Timing& b) { return ratios(a, b).median(); }

nlohmann::json ratio_json(const Timing& a, const Timing& b) { return spread(ratios(a, b), 1.0); }

nlohmann::json nanoseconds_json(const Timing& timing, double count) {
  return spread(timing, 1e9 / count);
}

}  // namespace sarnerf::bench
