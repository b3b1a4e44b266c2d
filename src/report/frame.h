// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "axis.h"
#include "svg_writer.h"
#include "ticks.h"

namespace sarnerf {

/// The part of a plot that stands still: the area of the data, its axes and the texts around it.
struct Frame {
  Rect area;
  AxisRange x, y;
  std::vector<Tick> x_ticks, y_ticks;
  std::vector<PlacedText> texts;
  double bottom_px = 0.0;  ///< below the lowest text

  double x_px(double value) const { return area.x0 + x.share(value) * area.width(); }
  double y_px(double value) const { return area.y1 - y.share(value) * area.height(); }
  Spot spot(const PlotPoint& point) const { return {x_px(point.x), y_px(point.y)}; }
  bool shows(const PlotPoint& point) const { return x.shows(point.x) && y.shows(point.y); }
};

/// Lengths as shares of the plot's text size.
inline constexpr double kMargin = 0.9;
inline constexpr double kTickLength = 0.38;

/// The frame within a strip `width_px` wide at the picture's left edge.
Frame frame_of(const Plot& plot, double width_px);

}  // namespace sarnerf
