// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "rect.h"
#include "sarnerf/report/plot.h"

namespace sarnerf {

inline constexpr std::string_view kInk = "#1a1a1a";       ///< titles, axes, what is emphasised
inline constexpr std::string_view kQuietInk = "#4d4d4d";  ///< labels
inline constexpr std::string_view kGridInk = "#e4e4e4";
inline constexpr std::string_view kBorderInk = "#c8c8c8";  ///< around the legend
inline constexpr std::string_view kPaper = "#ffffff";

/// How a series is drawn once everything automatic is decided.
struct SeriesStyle {
  std::string_view colour;
  PlotMarker marker = PlotMarker::circle;
  PlotLine line = PlotLine::solid;
  bool emphasised = false;
  double marker_radius_px = 0.0;  ///< 0 without marker
};

/// One style for each series of the plot. Colours repeat after seven, shapes after eight: 56 combinations.
std::vector<SeriesStyle> series_styles(const Plot& plot);

/// A marker as an SVG path. Shapes have the area of a circle of that radius, or look as if.
std::string marker_path(PlotMarker marker, Spot centre, double radius_px);

/// Attributes that paint a marker or a line of the style; `unit_px` is the width of a hairline.
std::string marker_paint(const SeriesStyle& style, double unit_px);
std::string line_paint(const SeriesStyle& style, double unit_px);

}  // namespace sarnerf
