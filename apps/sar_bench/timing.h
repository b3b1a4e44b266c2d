// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

namespace sarnerf::bench {

/// Seconds of repeated runs, with the robust figures that are quoted.
struct Timing {
  std::vector<double> seconds;
  double quantile(double q) const;
  double median() const { return quantile(0.5); }
};

/// Runs all contenders in turn, `rounds` times after one warm-up, so that drift of the machine meets
/// them alike and ratios between them can be trusted more than their times.
std::vector<Timing> run_in_turn(const std::vector<std::function<void()>>& contenders, int rounds);

/// Median of a / b, pair by pair.
double ratio(const Timing& a, const Timing& b);

/// Median and quartiles of a / b, pair by pair.
nlohmann::json ratio_json(const Timing& a, const Timing& b);

/// Median and quartiles, in nanoseconds for each of `count` items.
nlohmann::json nanoseconds_json(const Timing& timing, double count);

}  // namespace sarnerf::bench
