// SPDX-License-Identifier: Apache-2.0
#include "plot_layout.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "text_metrics.h"

namespace sarnerf {
namespace {

/// The widest legend inside the plot and to its right, as shares of the area's and the picture's width.
constexpr double kWidestInside = 0.45;
constexpr double kWidestRight = 0.34;

Obstacles obstacles_of(const Plot& plot, const std::vector<SeriesStyle>& styles,
                       const Frame& frame) {
  Obstacles found;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const PlotSeries& series = plot.series[s];
    const auto add = [&](const std::vector<Stroke>& strokes) {
      found.strokes.insert(found.strokes.end(), strokes.begin(), strokes.end());
    };
    if (series.line != PlotLine::none) add(strokes_of(series, frame));
    for (const PlotPoint& point : series.points) {
      add(bar_of(point, frame));
      if (styles[s].marker_radius_px == 0.0 || !frame.shows(point)) continue;
      const auto [x, y] = frame.spot(point);
      found.markers.push_back(Rect{x, y, x, y}.grown(1.2 * styles[s].marker_radius_px));
    }
  }
  return found;
}

bool covers_nothing(const Rect& box, const Plot& plot, const Frame& frame,
                    const Obstacles& obstacles) {
  const auto on_box = [&](const auto& obstacle) {
    if constexpr (std::is_same_v<std::decay_t<decltype(obstacle)>, Rect>) {
      return overlap(box, obstacle);
    } else {
      return crosses(obstacle, box);
    }
  };
  return std::none_of(obstacles.markers.begin(), obstacles.markers.end(), on_box) &&
         std::none_of(obstacles.strokes.begin(), obstacles.strokes.end(), on_box) &&
         std::none_of(plot.notes.begin(), plot.notes.end(), [&](const PlotNote& note) {
           return box.holds(frame.spot({note.x, note.y}));
         });
}

/// The legend in the first corner where it covers nothing, upper right first.
std::optional<Legend> legend_inside(const Plot& plot, const Frame& frame,
                                    const Obstacles& obstacles) {
  const double em = plot.text_px;
  const Legend legend = legend_of(plot, kWidestInside * frame.area.width(), 1);
  const Rect room = frame.area.grown(-0.5 * em);
  const double right = room.x1 - legend.box.width(), lower = room.y1 - legend.box.height();
  for (const Spot corner :
       {Spot{right, room.y0}, Spot{room.x0, room.y0}, Spot{room.x0, lower}, Spot{right, lower}}) {
    Legend there = moved(legend, corner);
    if (!room.grown(1e-6).holds(there.box)) return std::nullopt;
    if (covers_nothing(there.box.grown(0.3 * em), plot, frame, obstacles)) return there;
  }
  return std::nullopt;
}

void place_legend(PlotLayout& layout, const Plot& plot, const std::vector<SeriesStyle>& styles) {
  const double em = plot.text_px, width = plot.width_px, margin = kMargin * em;
  Frame& frame = layout.frame;
  if (legend_of(plot, width, 1).entries.empty()) return;
  if (auto inside = legend_inside(plot, frame, obstacles_of(plot, styles, frame))) {
    layout.legend = *std::move(inside);
    layout.legend_inside = true;
    return;
  }
  const Legend column = legend_of(plot, kWidestRight * width, 1);
  if (plot.legend_beside && column.box.height() <= frame.area.height()) {
    frame = frame_of(plot, width - column.box.width() - 0.5 * em);
    layout.legend = moved(column, {width - column.box.width() - 0.5 * em, frame.area.y0});
    return;
  }
  const Legend table = legend_of(plot, width - margin, plot.series.size());
  const double left = std::min(frame.area.x0, width - 0.5 * margin - table.box.width());
  layout.legend = moved(table, {left, frame.bottom_px + 0.3 * em});
}

}  // namespace

std::vector<Stroke> strokes_of(const PlotSeries& series, const Frame& frame) {
  std::vector<Stroke> strokes;
  for (std::size_t p = 1; p < series.points.size(); ++p) {
    Stroke stroke{frame.spot(series.points[p - 1]), frame.spot(series.points[p])};
    if (clip(stroke, frame.area)) strokes.push_back(stroke);
  }
  return strokes;
}

std::vector<Stroke> bar_of(const PlotPoint& point, const Frame& frame) {
  if (!point.y_low && !point.y_high) return {};
  double low = point.y_low.value_or(point.y);
  if (frame.y.scale == AxisScale::log) low = std::max(low, frame.y.low);
  const double x = frame.x_px(point.x);
  Stroke bar{{x, frame.y_px(low)}, {x, frame.y_px(point.y_high.value_or(point.y))}};
  return clip(bar, frame.area) ? std::vector{bar} : std::vector<Stroke>{};
}

PlotLayout lay_out(const Plot& plot, const std::vector<SeriesStyle>& styles) {
  const double em = plot.text_px;
  PlotLayout layout;
  layout.width_px = plot.width_px;
  layout.frame = frame_of(plot, plot.width_px);
  place_legend(layout, plot, styles);

  std::vector<Rect> taken;
  if (layout.legend_inside) taken.push_back(layout.legend.box);
  layout.notes = place_notes(plot, layout.frame, obstacles_of(plot, styles, layout.frame), taken);

  double bottom = std::max(layout.frame.bottom_px, layout.legend.box.y1);
  if (const std::size_t n = layout.notes.n_omitted; n > 0) {
    const std::string remark =
        std::to_string(n) + (n == 1 ? " note" : " notes") + " left out for want of room";
    layout.remarks.push_back({remark,
                              {layout.frame.area.x0, bottom + (0.3 + kAscent) * em},
                              em,
                              Anchor::start,
                              kQuietInk});
    bottom += (0.3 + kLineHeight) * em;
  }
  layout.height_px = std::max(plot.height_px, bottom + kMargin * em);
  return layout;
}

}  // namespace sarnerf
