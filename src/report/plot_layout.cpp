// SPDX-License-Identifier: Apache-2.0
#include "plot_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "svg.h"

namespace sarnerf {

namespace {

/// The widest legend: inside the plot as a fraction of the area's width, to its right of the picture's width.
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

/// The legend in the first corner where it covers nothing, beginning with the upper right.
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

namespace {

// Fractions of the text size.
constexpr double kPadding = 0.5;
constexpr double kSample = 2.0;      // length of the sample line
constexpr double kSampleGap = 0.55;  // between the sample line and the name
constexpr double kColumnGap = 1.6;
constexpr double kEntryHeight = 1.45;  // for one line of text; further lines add kLineHeight
constexpr std::size_t kMostLines = 3;

struct Name {
  std::size_t series = 0;
  std::vector<std::string> lines;
  double height_px = 0.0;
};

}  // namespace

Legend legend_of(const Plot& plot, double width_px, std::size_t max_columns) {
  const double em = plot.text_px, sample_px = (kSample + kSampleGap) * em;
  std::vector<Name> names;
  double widest = 0.0;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    Name name{s, wrap_text(clean_text(plot.series[s].name), em,
                           width_px - sample_px - 2.0 * kPadding * em, kMostLines)};
    if (name.lines.empty()) continue;
    for (const std::string& line : name.lines) widest = std::max(widest, text_width_px(line, em));
    name.height_px = (kEntryHeight + double(name.lines.size() - 1) * kLineHeight) * em;
    names.push_back(std::move(name));
  }
  Legend legend;
  if (names.empty()) return legend;

  const double column_px = sample_px + widest, step_px = column_px + kColumnGap * em;
  const auto fitting =
      std::size_t(std::max(1.0, (width_px - 2.0 * kPadding * em + kColumnGap * em) / step_px));
  const std::size_t columns = std::min({fitting, max_columns, names.size()});
  const std::size_t rows = (names.size() + columns - 1) / columns;

  double x = kPadding * em, y = kPadding * em;
  for (std::size_t n = 0; n < names.size(); ++n) {
    if (n > 0 && n % rows == 0) {
      x += step_px;
      y = kPadding * em;
    }
    const double middle = y + 0.5 * kEntryHeight * em;
    LegendEntry entry{names[n].series, {{x, middle}, {x + kSample * em, middle}}, {}};
    double baseline = middle + 0.5 * kCapHeight * em;
    for (std::string& line : names[n].lines) {
      entry.lines.push_back({std::move(line), {x + sample_px, baseline}, em, Anchor::start, kInk});
      baseline += kLineHeight * em;
    }
    y += names[n].height_px;
    legend.entries.push_back(std::move(entry));
    legend.box.y1 = std::max(legend.box.y1, y + kPadding * em);
  }
  legend.box.x1 = x + column_px + kPadding * em;
  return legend;
}

Legend moved(Legend legend, Spot by) {
  const auto move = [&](Spot& spot) { spot = {spot.x + by.x, spot.y + by.y}; };
  legend.box = {legend.box.x0 + by.x, legend.box.y0 + by.y, legend.box.x1 + by.x,
                legend.box.y1 + by.y};
  for (LegendEntry& entry : legend.entries) {
    move(entry.sample.from);
    move(entry.sample.to);
    for (PlacedText& line : entry.lines) move(line.at);
  }
  return legend;
}

namespace {

constexpr int kDirections = 24;
/// Distances from the point to try, in text sizes.
constexpr std::array<double, 11> kDistances{0.75, 1.2, 1.8,  2.6,  3.6, 5.0,
                                            7.0,  9.0, 11.0, 14.0, 18.0};

// Cost of covering a marker, line or leader, in text sizes of distance.
constexpr double kMarkerCost = 12.0;
constexpr double kStrokeCost = 6.0;
constexpr double kLeaderCost = 6.0;
// Cost of a leader that crosses a marker or text.
constexpr double kMarkerCrossing = 3.0;
constexpr double kTextCrossing = 8.0;

/// The point of the rectangle that is nearest to `spot`.
Spot nearest(const Rect& rect, Spot spot) {
  return {std::clamp(spot.x, rect.x0, rect.x1), std::clamp(spot.y, rect.y0, rect.y1)};
}

/// The line from the edge of the point's marker to the note, if they are apart.
std::optional<Stroke> leader_of(const Rect& box, Spot spot, double em) {
  const Spot end = nearest(box, spot);
  const double dx = end.x - spot.x, dy = end.y - spot.y, length = std::hypot(dx, dy);
  const double skipped = 0.6 * em;
  if (length < 1.5 * em) return std::nullopt;
  return Stroke{{spot.x + dx * skipped / length, spot.y + dy * skipped / length}, end};
}

/// Areas that are already occupied.
struct Taken {
  std::vector<Rect> boxes;
  std::vector<Stroke> leaders;
};

double cost(const Rect& box, const std::optional<Stroke>& leader, const Obstacles& obstacles,
            const Taken& taken) {
  double sum = 0.0;
  for (const Rect& marker : obstacles.markers) {
    if (overlap(box, marker)) sum += kMarkerCost;
    if (leader && crosses(*leader, marker)) sum += kMarkerCrossing;
  }
  for (const Stroke& stroke : obstacles.strokes) {
    if (crosses(stroke, box)) sum += kStrokeCost;
  }
  for (const Stroke& other : taken.leaders) {
    if (crosses(other, box)) sum += kLeaderCost;
  }
  if (!leader) return sum;
  for (const Rect& other : taken.boxes) {
    if (crosses(*leader, other)) sum += kTextCrossing;
  }
  return sum;
}

}  // namespace

PlacedNotes place_notes(const Plot& plot, const Frame& frame, const Obstacles& obstacles,
                        std::vector<Rect> taken_boxes) {
  const double em = plot.text_px;
  Taken taken{std::move(taken_boxes), {}};
  PlacedNotes placed;
  for (const PlotNote& note : plot.notes) {
    const PlotPoint point{note.x, note.y};
    auto lines = wrap_text(clean_text(note.text), em, 0.35 * frame.area.width(), kMostLines);
    if (lines.empty() || !frame.shows(point)) continue;
    double width = 0.0;
    for (const std::string& line : lines) width = std::max(width, text_width_px(line, em));
    const double height = (kAscent + kDescent + kLineHeight * double(lines.size() - 1)) * em;
    const Spot spot = frame.spot(point);

    std::optional<Rect> best;
    double least = 1e300;
    for (const double distance : kDistances) {
      for (int d = 0; d < kDirections; ++d) {
        // Starts at the upper right, then goes around.
        const double angle = 2.0 * std::numbers::pi * (d + 2) / kDirections;
        const double c = std::cos(angle), s = -std::sin(angle);
        // The note lies beside the point at that distance, whatever its size. With the direction, the
        // side of the note that faces the point changes from a side's middle to a corner.
        const Spot centre{
            spot.x + distance * em * c + 0.5 * width * std::clamp(1.6 * c, -1.0, 1.0),
            spot.y + distance * em * s + 0.5 * height * std::clamp(1.6 * s, -1.0, 1.0)};
        const Rect box{centre.x - 0.5 * width, centre.y - 0.5 * height, centre.x + 0.5 * width,
                       centre.y + 0.5 * height};
        if (!frame.area.holds(box.grown(0.15 * em))) continue;
        const Rect roomy = box.grown(0.2 * em);
        const bool on_text = std::any_of(taken.boxes.begin(), taken.boxes.end(),
                                         [&](const Rect& other) { return overlap(roomy, other); });
        if (on_text) continue;
        const double sum = distance + cost(roomy, leader_of(box, spot, em), obstacles, taken);
        if (sum < least) {
          least = sum;
          best = box;
        }
      }
    }
    if (!best) {
      ++placed.n_omitted;
      continue;
    }
    PlacedNote result{*best, {}, leader_of(*best, spot, em)};
    double baseline = best->y0 + kAscent * em;
    // Lines are aligned to the side that faces the point.
    const bool leftwards = best->x1<spot.x, rightwards = best->x0> spot.x;
    const Anchor anchor = leftwards ? Anchor::end : rightwards ? Anchor::start : Anchor::middle;
    const double x = leftwards ? best->x1 : rightwards ? best->x0 : 0.5 * (best->x0 + best->x1);
    for (std::string& line : lines) {
      result.lines.push_back({std::move(line), {x, baseline}, em, anchor, kInk});
      baseline += kLineHeight * em;
    }
    taken.boxes.push_back(*best);
    if (result.leader) taken.leaders.push_back(*result.leader);
    placed.notes.push_back(std::move(result));
  }
  return placed;
}

}  // namespace sarnerf
