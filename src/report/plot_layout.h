// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "frame.h"
#include "legend.h"
#include "notes.h"
#include "series_style.h"

namespace sarnerf {

/// Where everything stands.
struct PlotLayout {
  double width_px = 0.0, height_px = 0.0;
  Frame frame;
  Legend legend;
  bool legend_inside = false;
  PlacedNotes notes;
  std::vector<PlacedText> remarks;  ///< below everything
};

/// Places legend and notes as svg() says. The plot's values have been checked.
PlotLayout lay_out(const Plot& plot, const std::vector<SeriesStyle>& styles);

/// The visible pieces of a series' line.
std::vector<Stroke> strokes_of(const PlotSeries& series, const Frame& frame);

/// The visible part of a point's bar; none without one.
std::vector<Stroke> bar_of(const PlotPoint& point, const Frame& frame);

}  // namespace sarnerf
