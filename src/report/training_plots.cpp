// SPDX-License-Identifier: Apache-2.0
#include "training_plots.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "number_text.h"

namespace sarnerf {
namespace {

/// Curves whose times span more than this are drawn over the logarithm of time.
constexpr double kLogSpan = 20.0;

/// Curves of more points have no markers: they only hide them.
constexpr std::size_t kMostMarkedPoints = 25;

/// The grey of the palette: for what only helps to read.
constexpr int kGrey = 6;

bool drawable(double value) { return std::isfinite(value) && std::abs(value) < 1e9; }

/// A baseline has one colour in all plots: by its place among the baselines. Others come `after` them.
int colour_of(const TrainingReport& report, const std::string& name, std::size_t after) {
  const auto found = std::ranges::find(report.baselines, name, &ReportMethod::name);
  const auto place = std::size_t(found - report.baselines.begin());
  return int((found != report.baselines.end() ? place : place + after) % kGrey);
}

PlotSeries curve_series(const TrainingReport& report, const ReportCurve& curve, std::size_t place) {
  PlotSeries series;
  series.name = curve.name;
  series.emphasised = curve.emphasised;
  if (!curve.emphasised) series.colour = colour_of(report, curve.name, place);
  for (const CurvePoint& p : curve.points) {
    if (drawable(p.seconds) && drawable(p.psnr_db) && p.seconds >= 0.0) {
      series.points.push_back({p.seconds, p.psnr_db, {}, {}});
    }
  }
  if (series.points.size() > kMostMarkedPoints) series.marker = PlotMarker::none;
  return series;
}

/// Means over the views of one angle, in its order; bars where more than one view has it.
PlotSeries angle_series(const TrainingReport& report, const ReportMethod& method,
                        double ReportView::*angle, bool with_bars) {
  struct Group {
    double sum = 0.0, low = std::numeric_limits<double>::infinity(), high = -low;
    int n = 0;
  };
  std::map<double, Group> groups;
  for (std::size_t v = 0; v < method.per_view.size(); ++v) {
    const std::optional<double>& psnr_db = method.per_view[v].psnr_power_db;
    if (!psnr_db || !drawable(*psnr_db)) continue;
    Group& group = groups[report.held_out[v].*angle];
    group.sum += *psnr_db;
    group.low = std::min(group.low, *psnr_db);
    group.high = std::max(group.high, *psnr_db);
    ++group.n;
  }
  PlotSeries series;
  series.name = method.name;
  for (const auto& [x, group] : groups) {
    PlotPoint& point = series.points.emplace_back(PlotPoint{x, group.sum / group.n, {}, {}});
    if (!with_bars || group.n < 2) continue;
    point.y_low = group.low;
    point.y_high = group.high;
  }
  return series;
}

/// Marks along the lower border, which the lower limit leaves room for.
void mark_training_azimuths(const TrainingReport& report, Plot& plot) {
  if (report.training_azimuths_deg.empty()) return;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& p : series.points) {
      low = std::min(low, p.y_low.value_or(p.y));
      high = std::max(high, p.y_high.value_or(p.y));
    }
  }
  plot.y.low = low - 0.08 * std::max(high - low, 1.0);
  PlotSeries marks;
  marks.name = "training azimuths";
  marks.marker = PlotMarker::triangle;
  marks.line = PlotLine::none;
  marks.colour = kGrey;
  for (const double azimuth_deg : report.training_azimuths_deg) {
    if (drawable(azimuth_deg)) marks.points.push_back({azimuth_deg, *plot.y.low, {}, {}});
  }
  plot.series.push_back(marks);
}

std::size_t infinite_views(const ReportMethod& method) {
  return std::size_t(std::ranges::count_if(method.per_view, [](const ReportScores& scores) {
    return scores.psnr_power_db && std::isinf(*scores.psnr_power_db);
  }));
}

std::optional<PagePlot> angle_plot(const TrainingReport& report, double ReportView::*angle,
                                   const std::string& name) {
  if (!report.model) return {};
  PagePlot page_plot;
  Plot& plot = page_plot.plot;
  plot.title = "Held-out views over " + name;
  plot.x.label = name + " (°)";
  plot.y.label = "PSNR in power (dB)";
  plot.height_px = 440.0;
  plot.legend_beside = false;
  for (std::size_t b = 0; b < report.baselines.size(); ++b) {
    plot.series.push_back(angle_series(report, report.baselines[b], angle, false));
    plot.series.back().colour = int(b % kGrey);
  }
  PlotSeries ours = angle_series(report, *report.model, angle, true);
  if (ours.points.size() < 2) return {};
  const bool with_bars =
      std::ranges::any_of(ours.points, [](const PlotPoint& p) { return p.y_low.has_value(); });
  ours.emphasised = true;
  plot.series.push_back(ours);
  std::erase_if(plot.series, [](const PlotSeries& series) { return series.points.empty(); });
  // The model's name comes first in the legend; being emphasised, it is drawn above the others all the same.
  std::ranges::rotate(plot.series, plot.series.end() - 1);
  if (angle == &ReportView::azimuth_deg) mark_training_azimuths(report, plot);

  page_plot.caption = "PSNR in power of each held-out view";
  if (with_bars)
    page_plot.caption = "Mean PSNR in power of the held-out views of one " + name +
                        "; bars from the lowest to the highest";
  page_plot.caption += '.';
  if (const std::size_t infinite = infinite_views(*report.model)) {
    page_plot.caption += " Not drawn: " + count(infinite, "view") + " of infinite PSNR.";
  }
  return page_plot;
}

}  // namespace

std::optional<PagePlot> curve_plot(const TrainingReport& report) {
  PagePlot page_plot;
  Plot& plot = page_plot.plot;
  plot.title = "PSNR against time";
  plot.x.label = "time since the program's start (s)";
  plot.y.label = "PSNR in power (dB)";
  plot.height_px = 480.0;
  plot.legend_beside = false;
  double first = std::numeric_limits<double>::infinity(), last = 0.0;
  for (std::size_t c = 0; c < report.curves.size(); ++c) {
    const PlotSeries series = curve_series(report, report.curves[c], c);
    if (series.points.empty()) continue;
    for (const PlotPoint& p : series.points) {
      first = std::min(first, p.x);
      last = std::max(last, p.x);
    }
    plot.series.push_back(series);
  }
  if (plot.series.empty()) return {};
  if (first > 0.0 && last > kLogSpan * first) {
    plot.x.scale = AxisScale::log;
  } else {
    plot.x.low = first = 0.0;
  }
  if (last == 0.0) plot.x.high = last = 1.0;
  for (std::size_t l = 0; l < report.levels.size(); ++l) {
    const ReportLevel& level = report.levels[l];
    if (!drawable(level.psnr_db)) continue;
    PlotSeries line;
    line.name = level.name;
    line.points = {{first, level.psnr_db, {}, {}}, {last, level.psnr_db, {}, {}}};
    line.marker = PlotMarker::none;
    line.line = PlotLine::dashed;
    line.colour = colour_of(report, level.name, report.curves.size() + l);
    plot.series.push_back(line);
  }
  page_plot.caption = "PSNR in power";
  if (!report.curve_views.empty()) page_plot.caption += " of " + report.curve_views;
  page_plot.caption += " against wall-clock time, start-up and reading included.";
  if (!report.levels.empty()) {
    page_plot.caption +=
        " Dashed: what interpolation between the training views reaches on the same views.";
  }
  return page_plot;
}

std::optional<PagePlot> azimuth_plot(const TrainingReport& report) {
  return angle_plot(report, &ReportView::azimuth_deg, "azimuth");
}

std::optional<PagePlot> incidence_plot(const TrainingReport& report) {
  return angle_plot(report, &ReportView::incidence_deg, "incidence");
}

}  // namespace sarnerf
