// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/report/plot.h"
#include "svg.h"

namespace sarnerf {

/// A tick on an axis. Minor ticks have no label.
struct Tick {
  double value = 0.0;
  std::string label{};
};

/// Default for the most labels of an axis. Steps grow by factors of at most 2.5, so with room for eight at least three fit.
inline constexpr int kMostLabels = 8;

/// The ticks of a linear axis within [low, high]: multiples of a step of 1, 2 or 5 times a power of ten, the
/// smallest that gives at most `most_labels`. With kMostLabels there are at least three. Needs
/// high − low ≥ 1e-6 max(|low|, |high|), so that neighbouring labels differ. In rising order.
std::vector<Tick> linear_ticks(double low, double high, int most_labels = kMostLabels);

/// The ticks of a logarithmic axis within [low, high], low > 0. Labels:
///
///   - powers of ten, if at least three lie within, or one does and the next case has too many labels; if they are too
///     many, every second, third, fifth …;
///   - else 1, 2 and 5 times powers of ten, if three to `most_labels` of these lie within;
///   - else the ticks of a linear axis.
///
/// Minor ticks in the first case: unlabelled powers of ten or, if all have labels, 2 and 5 times powers of ten. In the
/// second case: 3, 4, 6, 7, 8 and 9 times powers of ten. Same bounds as linear_ticks.
std::vector<Tick> log_ticks(double low, double high, int most_labels = kMostLabels);

/// linear_ticks() or log_ticks(), by the scale.
std::vector<Tick> ticks(AxisScale scale, double low, double high, int most_labels = kMostLabels);

/// Scale and limits of an axis.
struct AxisRange {
  AxisScale scale = AxisScale::linear;
  double low = 0.0, high = 1.0;

  bool shows(double value) const { return value >= low && value <= high; }
  /// Position along the axis: 0 at `low`, 1 at `high`; below 0 or above 1 for values outside.
  double share(double value) const;
};

/// The limits of `plot.x` and `plot.y`: those given, else 4 % beyond the data, bars and notes included. An open
/// linear limit does not cross zero unless a value does. Throws UsageError as svg().
AxisRange x_range(const Plot& plot);
AxisRange y_range(const Plot& plot);

/// Throws UsageError for values that cannot be drawn on their axis; see svg().
void check_values(const Plot& plot);

inline constexpr std::string_view kInk = "#1a1a1a";       ///< titles, axes, emphasised series
inline constexpr std::string_view kQuietInk = "#4d4d4d";  ///< labels
inline constexpr std::string_view kGridInk = "#e4e4e4";
inline constexpr std::string_view kBorderInk = "#c8c8c8";  ///< around the legend
inline constexpr std::string_view kPaper = "#ffffff";

/// How a series is drawn, with all automatic choices made.
struct SeriesStyle {
  std::string_view colour;
  PlotMarker marker = PlotMarker::circle;
  PlotLine line = PlotLine::solid;
  bool emphasised = false;
  double marker_radius_px = 0.0;  ///< 0 without marker
};

/// One style for each series of the plot. Colours repeat after seven, shapes after eight: 56 combinations.
std::vector<SeriesStyle> series_styles(const Plot& plot);

/// A marker as an SVG path. Shapes have about the area of a circle of that radius.
std::string marker_path(PlotMarker marker, Spot centre, double radius_px);

/// Attributes that paint a marker or a line of the style; `unit_px` is the width of a hairline.
std::string marker_paint(const SeriesStyle& style, double unit_px);
std::string line_paint(const SeriesStyle& style, double unit_px);

/// The fixed part of a plot: the area of the data, its axes and the texts around it.
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

/// Lengths as fractions of the plot's text size.
inline constexpr double kMargin = 0.9;
inline constexpr double kTickLength = 0.38;

/// The frame within a strip `width_px` wide at the picture's left edge.
Frame frame_of(const Plot& plot, double width_px);

/// A series in the legend: a piece of its line with its marker in the middle, and its name.
struct LegendEntry {
  std::size_t series = 0;
  Stroke sample;
  std::vector<PlacedText> lines;
};

struct Legend {
  Rect box;
  std::vector<LegendEntry> entries;
};

/// The legend with its upper left corner at the origin: columns of equal width, filled one after the other, as
/// many as fit into `width_px` but at most `max_columns`. Names wider than `width_px` are broken into lines. No
/// entries when no series has a name.
Legend legend_of(const Plot& plot, double width_px, std::size_t max_columns);

/// The legend shifted by `by`.
Legend moved(Legend legend, Spot by);

/// The markers and lines that the data cover.
struct Obstacles {
  std::vector<Rect> markers;
  std::vector<Stroke> strokes;
};

struct PlacedNote {
  Rect box;
  std::vector<PlacedText> lines;
  std::optional<Stroke> leader;  ///< from the point to the note, when the note is not beside it
};

struct PlacedNotes {
  std::vector<PlacedNote> notes;
  std::size_t n_omitted = 0;  ///< for lack of room
};

/// Finds for each note, in order, the position around its point that covers least. A note never covers a text placed
/// before it or the rectangles `taken`; lines are covered in preference to markers, and near positions are preferred.
/// Notes outside the limits are left out silently, as points are. O(notes × obstacles).
PlacedNotes place_notes(const Plot& plot, const Frame& frame, const Obstacles& obstacles,
                        std::vector<Rect> taken);

/// Positions of all parts of a plot.
struct PlotLayout {
  double width_px = 0.0, height_px = 0.0;
  Frame frame;
  Legend legend;
  bool legend_inside = false;
  PlacedNotes notes;
  std::vector<PlacedText> remarks;  ///< below everything
};

/// Places legend and notes as described at svg(). Precondition: check_values() has passed.
PlotLayout lay_out(const Plot& plot, const std::vector<SeriesStyle>& styles);

/// The visible pieces of a series' line.
std::vector<Stroke> strokes_of(const PlotSeries& series, const Frame& frame);

/// The visible part of a point's bar; empty if the point has no bar.
std::vector<Stroke> bar_of(const PlotPoint& point, const Frame& frame);

}  // namespace sarnerf
