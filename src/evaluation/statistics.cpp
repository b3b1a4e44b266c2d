// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/evaluation/evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <boost/math/distributions/students_t.hpp>

#include "sarnerf/core/error.h"

namespace sarnerf {

PairedDifference paired_difference(std::span<const double> differences) {
  if (differences.empty()) throw UsageError("expected differences of one draw or more, found none");
  PairedDifference result;
  result.n = static_cast<int>(differences.size());
  result.mean = std::accumulate(differences.begin(), differences.end(), 0.0) / result.n;
  if (result.n < 2) {
    result.low = -std::numeric_limits<double>::infinity();
    result.high = result.smallest_detectable = std::numeric_limits<double>::infinity();
    return result;
  }
  double squares = 0.0;
  for (const double d : differences) squares += (d - result.mean) * (d - result.mean);
  const double error = std::sqrt(squares / (result.n - 1) / result.n);
  const boost::math::students_t t(result.n - 1);
  const double reach = boost::math::quantile(t, 0.975) * error;
  result.low = result.mean - reach;
  result.high = result.mean + reach;
  result.smallest_detectable = reach + boost::math::quantile(t, 0.8) * error;
  if (error > 0.0) {
    result.p = 2.0 * boost::math::cdf(boost::math::complement(t, std::abs(result.mean) / error));
  } else {
    result.p = result.mean == 0.0 ? 1.0 : 0.0;
  }
  return result;
}

double jackknife_error(std::span<const double> without_one) {
  if (without_one.size() < 2) throw UsageError("expected two groups or more for a standard error, found fewer");
  const auto n = static_cast<double>(without_one.size());
  const double mean = std::accumulate(without_one.begin(), without_one.end(), 0.0) / n;
  double squares = 0.0;
  for (const double x : without_one) squares += (x - mean) * (x - mean);
  return std::sqrt((n - 1.0) / n * squares);
}

std::vector<double> holm(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t n) { return p[n]; });
  std::vector<double> raised(p.size());
  double largest = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    largest = std::max(largest, static_cast<double>(p.size() - rank) * p[order[rank]]);
    raised[order[rank]] = std::min(1.0, largest);
  }
  return raised;
}

}  // namespace sarnerf
