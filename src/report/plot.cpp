// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/report/plot.h"

#include <string>
#include <vector>

#include "plot_layout.h"
#include "sarnerf/core/error.h"
#include "svg_writer.h"
#include "text_metrics.h"

namespace sarnerf {
namespace {

/// The size below which a frame with its labels leaves no room for data, in text sizes.
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

/// The strokes as one path, joined where one begins at the other's end, so that corners and dashes go on.
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

/// Bars under lines under markers; what is emphasised above the rest of its kind, rings above all.
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
