// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/plot.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "plot_layout.h"
#include "sarnerf/core/error.h"
#include "svg.h"

namespace sarnerf {

namespace {

/// Okabe and Ito's colours, in an order in which neighbours differ clearly. Grey replaces their yellow, which
/// is hard to see on white. Their black is for emphasised series.
constexpr std::array<std::string_view, 7> kPalette{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                   "#e69f00", "#56b4e9", "#777777"};

constexpr std::array<PlotMarker, 8> kMarkers{
    PlotMarker::circle,        PlotMarker::square,   PlotMarker::triangle, PlotMarker::diamond,
    PlotMarker::triangle_down, PlotMarker::pentagon, PlotMarker::cross,    PlotMarker::plus};

/// A line with more points is drawn as a curve without markers, which would hide it.
constexpr std::size_t kMostMarkedPoints = 60;

std::string polygon(Spot centre, double radius_px, int corners, double first_rad) {
  std::string path;
  for (int n = 0; n < corners; ++n) {
    const double angle = first_rad + 2.0 * std::numbers::pi * n / corners;
    path += n == 0 ? 'M' : 'L';
    path += number(centre.x + radius_px * std::cos(angle)) + ' ' +
            number(centre.y + radius_px * std::sin(angle));
  }
  return path + 'Z';
}

/// A bold plus, turned by `angle_rad`.
std::string bars(Spot centre, double reach_px, double angle_rad) {
  const double half = 0.34 * reach_px;
  std::string path;
  for (int arm = 0; arm < 4; ++arm) {
    const double angle = angle_rad + 0.5 * std::numbers::pi * arm;
    const double c = std::cos(angle), s = std::sin(angle);
    // The arm's two outer corners, then the inner corner before the next arm.
    for (const Spot p : {Spot{reach_px, -half}, Spot{reach_px, half}, Spot{half, half}}) {
      path += path.empty() ? 'M' : 'L';
      path += number(centre.x + c * p.x - s * p.y) + ' ' + number(centre.y + s * p.x + c * p.y);
    }
  }
  return path + 'Z';
}

}  // namespace

std::vector<SeriesStyle> series_styles(const Plot& plot) {
  std::vector<SeriesStyle> styles;
  std::size_t next_colour = 0, next_shape = 0;  // rings use neither, emphasised series no colour
  for (const PlotSeries& series : plot.series) {
    SeriesStyle style;
    const bool ring = series.marker == PlotMarker::ring;
    const std::size_t shape = ring ? 0 : next_shape++;
    const std::size_t number = ring || series.emphasised ? 0 : next_colour++;
    // The sum maps negative numbers into the palette, too.
    const auto chosen = series.colour ? std::size_t(*series.colour % 7 + 7) : number;
    style.colour = series.emphasised ? kInk : kPalette[chosen % kPalette.size()];
    style.line = series.line;
    style.emphasised = series.emphasised;
    style.marker = series.marker;
    if (style.marker == PlotMarker::automatic) {
      const bool curve = series.points.size() > kMostMarkedPoints && series.line != PlotLine::none;
      style.marker = curve ? PlotMarker::none : kMarkers[shape % kMarkers.size()];
    }
    if (style.marker != PlotMarker::none) {
      style.marker_radius_px = (style.marker == PlotMarker::ring ? 0.52 : 0.31) * plot.text_px;
    }
    styles.push_back(style);
  }
  return styles;
}

std::string marker_path(PlotMarker marker, Spot centre, double radius_px) {
  constexpr double kQuarter = 0.5 * std::numbers::pi;
  switch (marker) {
    case PlotMarker::square:
      return polygon(centre, 1.25 * radius_px, 4, 0.5 * kQuarter);
    case PlotMarker::diamond:
      return polygon(centre, 1.3 * radius_px, 4, 0.0);
    case PlotMarker::triangle:
      return polygon({centre.x, centre.y + 0.2 * radius_px}, 1.4 * radius_px, 3, -kQuarter);
    case PlotMarker::triangle_down:
      return polygon({centre.x, centre.y - 0.2 * radius_px}, 1.4 * radius_px, 3, kQuarter);
    case PlotMarker::pentagon:
      return polygon(centre, 1.15 * radius_px, 5, -kQuarter);
    case PlotMarker::plus:
      return bars(centre, 1.2 * radius_px, 0.0);
    case PlotMarker::cross:
      return bars(centre, 1.2 * radius_px, 0.5 * kQuarter);
    case PlotMarker::none:
      return {};
    case PlotMarker::automatic:
    case PlotMarker::ring:
    case PlotMarker::circle:
      break;
  }
  const std::string r = number(radius_px), across = number(2.0 * radius_px);
  const std::string arc = "a" + r + ' ' + r + " 0 1 0 ";
  return 'M' + number(centre.x - radius_px) + ' ' + number(centre.y) + arc + across + " 0" + arc +
         '-' + across + " 0Z";
}

std::string marker_paint(const SeriesStyle& style, double unit_px) {
  const std::string colour(style.colour);
  if (style.marker == PlotMarker::ring) {
    return "fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"" + number(1.5 * unit_px) + '"';
  }
  // The thin light border separates overlapping markers.
  return "fill=\"" + colour + "\" stroke=\"" + std::string(kPaper) + "\" stroke-width=\"" +
         number(0.8 * unit_px) + '"';
}

std::string line_paint(const SeriesStyle& style, double unit_px) {
  std::string paint = "fill=\"none\" stroke=\"" + std::string(style.colour) + "\" stroke-width=\"" +
                      number((style.emphasised ? 2.0 : 1.7) * unit_px) +
                      "\" stroke-linejoin=\"round\"";
  if (style.line == PlotLine::dashed) {
    paint += " stroke-dasharray=\"" + number(6.0 * unit_px) + ' ' + number(4.0 * unit_px) + '"';
  }
  return paint;
}

namespace {

/// Least size of a plot, in text sizes: below it, the labels leave no room for data.
constexpr double kLeastWidth = 24.0, kLeastHeight = 16.0;
constexpr double kLeastText_px = 12.0, kLargestSide_px = 16384.0;

void check_size(const Plot& plot) {
  if (!(plot.text_px >= kLeastText_px)) {
    throw UsageError("plot: expected text of at least 12 pixels, found " +
                     std::to_string(plot.text_px));
  }
  const double least_width = kLeastWidth * plot.text_px, least_height = kLeastHeight * plot.text_px;
  if (!(plot.width_px >= least_width && plot.height_px >= least_height &&
        plot.width_px <= kLargestSide_px && plot.height_px <= kLargestSide_px)) {
    const auto size = [](double width_px, double height_px) {
      return std::to_string(width_px) + " x " + std::to_string(height_px);
    };
    throw UsageError("plot: expected a size from " + size(least_width, least_height) +
                     " (for this text size) to 16384 x 16384 pixels, found " +
                     size(plot.width_px, plot.height_px));
  }
}

std::string stroke_paint(std::string_view colour, double width_px) {
  return "fill=\"none\" stroke=\"" + std::string(colour) + "\" stroke-width=\"" + number(width_px) +
         '"';
}

void draw_grid(SvgWriter& out, const Frame& frame, double unit_px) {
  const Rect& area = frame.area;
  std::string grid;
  for (const Tick& tick : frame.x_ticks) {
    const double x = frame.x_px(tick.value);
    if (!tick.label.empty()) grid += path_of({{x, area.y0}, {x, area.y1}});
  }
  for (const Tick& tick : frame.y_ticks) {
    const double y = frame.y_px(tick.value);
    if (!tick.label.empty()) grid += path_of({{area.x0, y}, {area.x1, y}});
  }
  out.path(grid, stroke_paint(kGridInk, unit_px));
}

void draw_axes(SvgWriter& out, const Frame& frame, double em, double unit_px) {
  const Rect& area = frame.area;
  std::string lines = path_of({{area.x0, area.y0}, {area.x0, area.y1}}) +
                      path_of({{area.x0, area.y1}, {area.x1, area.y1}});
  const auto length = [&](const Tick& tick) {
    return (tick.label.empty() ? 0.55 : 1.0) * kTickLength * em;
  };
  for (const Tick& tick : frame.x_ticks) {
    const double x = frame.x_px(tick.value);
    lines += path_of({{x, area.y1}, {x, area.y1 + length(tick)}});
  }
  for (const Tick& tick : frame.y_ticks) {
    const double y = frame.y_px(tick.value);
    lines += path_of({{area.x0 - length(tick), y}, {area.x0, y}});
  }
  out.path(lines, stroke_paint(kInk, 1.1 * unit_px) + " stroke-linecap=\"square\"");
}

/// The strokes as one path. A stroke that begins at the end of the previous one is joined, so that corners and dashes continue.
std::string joined(const std::vector<Stroke>& strokes) {
  std::string path;
  for (std::size_t s = 0; s < strokes.size(); ++s) {
    const bool goes_on = s > 0 && number(strokes[s - 1].to.x) == number(strokes[s].from.x) &&
                         number(strokes[s - 1].to.y) == number(strokes[s].from.y);
    path += goes_on ? 'L' + number(strokes[s].to.x) + ' ' + number(strokes[s].to.y)
                    : path_of(strokes[s]);
  }
  return path;
}

void draw_bars(SvgWriter& out, const PlotSeries& series, const SeriesStyle& style,
               const Frame& frame, double em, double unit_px) {
  std::string path;
  for (const PlotPoint& point : series.points) {
    for (const Stroke& bar : bar_of(point, frame)) {
      path += path_of(bar);
      for (const Spot& end : {bar.from, bar.to}) {
        path += path_of({{end.x - 0.22 * em, end.y}, {end.x + 0.22 * em, end.y}});
      }
    }
  }
  out.path(path, stroke_paint(style.colour, 1.2 * unit_px) + " stroke-opacity=\"0.7\"");
}

void draw_markers(SvgWriter& out, const PlotSeries& series, const SeriesStyle& style,
                  const Frame& frame, double unit_px) {
  for (const PlotPoint& point : series.points) {
    if (!frame.shows(point)) continue;
    out.path(marker_path(style.marker, frame.spot(point), style.marker_radius_px),
             marker_paint(style, unit_px));
  }
}

/// Drawing order: bars, lines, markers; emphasised lines and markers after the others of their kind, rings last.
void draw_data(SvgWriter& out, const Plot& plot, const std::vector<SeriesStyle>& styles,
               const Frame& frame, double unit_px) {
  for (std::size_t s = 0; s < styles.size(); ++s) {
    draw_bars(out, plot.series[s], styles[s], frame, plot.text_px, unit_px);
  }
  for (const bool emphasised : {false, true}) {
    for (std::size_t s = 0; s < styles.size(); ++s) {
      if (styles[s].emphasised != emphasised || styles[s].line == PlotLine::none) continue;
      out.path(joined(strokes_of(plot.series[s], frame)), line_paint(styles[s], unit_px));
    }
  }
  const auto layer = [](const SeriesStyle& style) {
    return style.marker == PlotMarker::ring ? 2 : style.emphasised ? 1 : 0;
  };
  for (int now = 0; now < 3; ++now) {
    for (std::size_t s = 0; s < styles.size(); ++s) {
      if (layer(styles[s]) == now) draw_markers(out, plot.series[s], styles[s], frame, unit_px);
    }
  }
}

void draw_legend(SvgWriter& out, const PlotLayout& layout, const std::vector<SeriesStyle>& styles,
                 double unit_px) {
  if (layout.legend.entries.empty()) return;
  out.begin_group("legend");
  if (layout.legend_inside) out.rect(layout.legend.box, kPaper, kBorderInk);
  for (const LegendEntry& entry : layout.legend.entries) {
    const SeriesStyle& style = styles[entry.series];
    const Stroke& sample = entry.sample;
    if (style.line != PlotLine::none) out.path(path_of(sample), line_paint(style, unit_px));
    const Spot middle{0.5 * (sample.from.x + sample.to.x), sample.from.y};
    out.path(marker_path(style.marker, middle, style.marker_radius_px),
             marker_paint(style, unit_px));
    for (const PlacedText& line : entry.lines) out.text(line);
  }
  out.end_group();
}

void draw_notes(SvgWriter& out, const PlacedNotes& notes, double em, double unit_px) {
  if (notes.notes.empty()) return;
  out.begin_group("notes");
  for (const PlacedNote& note : notes.notes) {
    if (note.leader) out.path(path_of(*note.leader), stroke_paint(kQuietInk, unit_px));
  }
  for (const PlacedNote& note : notes.notes) {
    out.rect(note.box.grown(0.1 * em), kPaper, "none", 0.8);
    for (const PlacedText& line : note.lines) out.text(line);
  }
  out.end_group();
}

}  // namespace

std::string svg(const Plot& plot) {
  check_size(plot);
  check_values(plot);
  const std::vector<SeriesStyle> styles = series_styles(plot);
  const PlotLayout layout = lay_out(plot, styles);

  const double em = plot.text_px, unit_px = em / 16.0;
  SvgWriter out(layout.width_px, layout.height_px, clean_text(plot.title));
  out.rect({0.0, 0.0, layout.width_px, layout.height_px}, kPaper);
  draw_grid(out, layout.frame, unit_px);
  draw_axes(out, layout.frame, em, unit_px);
  out.begin_group("data");
  draw_data(out, plot, styles, layout.frame, unit_px);
  out.end_group();
  draw_legend(out, layout, styles, unit_px);
  draw_notes(out, layout.notes, em, unit_px);
  out.begin_group("labels");
  for (const PlacedText& text : layout.frame.texts) out.text(text);
  for (const PlacedText& text : layout.remarks) out.text(text);
  out.end_group();
  return out.finish();
}

}  // namespace sarnerf
