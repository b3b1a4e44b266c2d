// SPDX-License-Identifier: Apache-2.0
#include "axis.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

/// Beyond, products of values and pixels would leave the finite numbers.
constexpr double kLargest = 1e100;
/// Room beyond the data, as a share of its extent.
constexpr double kRoom = 0.04;
/// The narrowest limits, as a share of the larger: labels then differ within seven digits.
constexpr double kNarrowest = 1e-6;

std::string text_of(double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return {buffer, end};
}

void check(double value, AxisScale scale, const std::string& where) {
  if (!std::isfinite(value) || std::abs(value) > kLargest) {
    throw UsageError(where + ": expected a number of magnitude up to 1e100, found " +
                     text_of(value) + "; leave such points out of the plot");
  }
  if (scale == AxisScale::log && value < 1.0 / kLargest) {
    throw UsageError(where + ": expected a value above zero for a logarithmic axis, found " +
                     text_of(value) + "; leave it out or take a linear axis");
  }
}

void check_limits(const PlotAxis& axis, const std::string& name) {
  if (axis.low) check(*axis.low, axis.scale, "plot: lower limit of " + name);
  if (axis.high) check(*axis.high, axis.scale, "plot: upper limit of " + name);
  if (!axis.low || !axis.high) return;
  const double least = kNarrowest * std::max(std::abs(*axis.low), std::abs(*axis.high));
  if (!(*axis.high - *axis.low >= least) || *axis.low == *axis.high) {
    throw UsageError("plot: limits of " + name +
                     ": expected an upper limit above the lower one by at least a "
                     "millionth of it, found " +
                     text_of(*axis.low) + " to " + text_of(*axis.high));
  }
}

/// Smallest and largest value.
struct Extent {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

AxisRange linear_range(const PlotAxis& axis, Extent data) {
  double low = axis.low.value_or(data.low), high = axis.high.value_or(data.high);
  // One value alone, or data on the far side of the given limit: some room on the open sides.
  const double least = kNarrowest * std::max(std::abs(low), std::abs(high));
  if (!(high - low > least)) {
    const double room =
        low == 0.0 && high == 0.0 ? 1.0 : 0.1 * std::max(std::abs(low), std::abs(high));
    if (!axis.high) high = std::max(high, low) + room;
    if (!axis.low) low = std::min(low, axis.high.value_or(low)) - room;
  }
  const double room = kRoom * (high - low);
  if (!axis.low) low = data.low >= 0.0 && low >= 0.0 ? std::max(0.0, low - room) : low - room;
  if (!axis.high) high = data.high <= 0.0 && high <= 0.0 ? std::min(0.0, high + room) : high + room;
  return {AxisScale::linear, low, high};
}

AxisRange log_range(const PlotAxis& axis, Extent data) {
  double low = axis.low.value_or(data.low), high = axis.high.value_or(data.high);
  if (!(high > low * (1.0 + kNarrowest))) {
    if (!axis.high) high = 1.5 * std::max(high, low);
    if (!axis.low) low = std::min(low, axis.high.value_or(low)) / 1.5;
  }
  const double room = std::pow(high / low, kRoom);
  return {AxisScale::log, axis.low ? low : low / room, axis.high ? high : high * room};
}

AxisRange range(const PlotAxis& axis, const std::string& name, const Extent& data) {
  check_limits(axis, name);
  if (data.low > data.high && !(axis.low && axis.high)) {
    throw UsageError(
        "plot: expected at least one point, or both limits of both axes, found neither");
  }
  return axis.scale == AxisScale::log ? log_range(axis, data) : linear_range(axis, data);
}

}  // namespace

double AxisRange::share(double value) const {
  if (scale == AxisScale::linear) return (value - low) / (high - low);
  return std::log(value / low) / std::log(high / low);
}

AxisRange x_range(const Plot& plot) {
  Extent data;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& point : series.points) data.add(point.x);
  }
  for (const PlotNote& note : plot.notes) data.add(note.x);
  return range(plot.x, "x", data);
}

AxisRange y_range(const Plot& plot) {
  Extent data;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& point : series.points) {
      data.add(point.y);
      if (point.y_high) data.add(*point.y_high);
      if (point.y_low && (plot.y.scale == AxisScale::linear || *point.y_low >= 1.0 / kLargest)) {
        data.add(*point.y_low);
      }
    }
  }
  for (const PlotNote& note : plot.notes) data.add(note.y);
  return range(plot.y, "y", data);
}

void check_values(const Plot& plot) {
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const PlotSeries& series = plot.series[s];
    for (std::size_t p = 0; p < series.points.size(); ++p) {
      const PlotPoint& point = series.points[p];
      const std::string where = "plot: series[" + std::to_string(s) + "] '" + series.name +
                                "', point " + std::to_string(p) + ": ";
      check(point.x, plot.x.scale, where + "x");
      check(point.y, plot.y.scale, where + "y");
      if (point.y_low) check(*point.y_low, AxisScale::linear, where + "lower end of the bar");
      if (point.y_high) check(*point.y_high, plot.y.scale, where + "upper end of the bar");
    }
  }
  for (std::size_t n = 0; n < plot.notes.size(); ++n) {
    const std::string where = "plot: notes[" + std::to_string(n) + "]: ";
    check(plot.notes[n].x, plot.x.scale, where + "x");
    check(plot.notes[n].y, plot.y.scale, where + "y");
  }
}

}  // namespace sarnerf
