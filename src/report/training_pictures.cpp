// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/dataset/image_file.h"
#include "training_parts.h"

namespace sarnerf {

namespace {

/// Colours at 0, half the limit and the limit.
constexpr std::array<Colour, 3> kBelow{{{245, 245, 245}, {86, 180, 233}, {10, 72, 150}}};
constexpr std::array<Colour, 3> kAbove{{{245, 245, 245}, {230, 159, 0}, {148, 40, 0}}};

Colour between(const std::array<Colour, 3>& anchors, float share) {
  const float place = 2.0f * share;
  const std::size_t from = place < 1.0f ? 0 : 1;
  const float weight = place - static_cast<float>(from);
  Colour colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const float value = (1.0f - weight) * anchors[from][c] + weight * anchors[from + 1][c];
    colour[c] = static_cast<std::uint8_t>(std::lround(value));
  }
  return colour;
}

}  // namespace

Image<Colour> signed_colours(const Image<float>& values, float limit) {
  Image<Colour> picture(values.n_azimuth(), values.n_range());
  for (std::size_t n = 0; n < picture.pixels().size(); ++n) {
    const float v = values.pixels()[n];
    if (!std::isfinite(v)) continue;
    const float share = limit > 0.0f ? std::min(std::abs(v) / limit, 1.0f) : 0.0f;
    picture.pixels()[n] = between(v < 0.0f ? kBelow : kAbove, share);
  }
  return picture;
}

namespace {

constexpr int kScaleSteps = 255;       // odd, so that zero has its own step
constexpr double kShownShare = 0.999;  ///< fraction of the differences within their scale

std::string size_text(const Image<float>& image) {
  return std::to_string(image.n_azimuth()) + " × " + std::to_string(image.n_range());
}

void check(const ReportPictures& pictures) {
  const Image<float>&truth = pictures.truth, &prediction = pictures.prediction;
  if (truth.n_azimuth() == prediction.n_azimuth() && truth.n_range() == prediction.n_range())
    return;
  throw UsageError("report: view '" + pictures.view.name +
                   "': expected a prediction of the truth's size, " + size_text(truth) +
                   ", found " + size_text(prediction));
}

/// Scales common to all pictures.
struct Scales {
  float white = 0.0f;          ///< power shown white
  double peak = 0.0;           ///< reference of the differences
  double limit_percent = 1.0;  ///< the largest difference shown
  bool peak_of_training = true;
};

/// Prediction minus truth in percent of the peak.
Image<float> difference_percent(const ReportPictures& pictures, double peak) {
  Image<float> difference(pictures.truth.n_azimuth(), pictures.truth.n_range());
  for (std::size_t n = 0; n < difference.pixels().size(); ++n) {
    const double d = double(pictures.prediction.pixels()[n]) - double(pictures.truth.pixels()[n]);
    difference.pixels()[n] = static_cast<float>(100.0 * d / peak);
  }
  return difference;
}

/// The magnitude that a fraction `kShownShare` of the pixels does not exceed.
double usual_magnitude(const std::vector<ReportPictures>& all, double peak) {
  std::vector<float> magnitudes;
  for (const ReportPictures& pictures : all) {
    const Image<float> difference = difference_percent(pictures, peak);
    for (const float d : difference.pixels()) {
      if (std::isfinite(d)) magnitudes.push_back(std::abs(d));
    }
  }
  if (magnitudes.empty()) return 0.0;
  return quantile_below(magnitudes, kShownShare);
}

Scales scales_of(const TrainingReport& report) {
  Scales scales;
  scales.peak = report.peak_power;
  float brightest = 0.0f;
  for (const ReportPictures& pictures : report.pictures) {
    scales.white = std::max(scales.white, white_level(pictures.truth));
    for (const float p : pictures.truth.pixels()) {
      if (std::isfinite(p)) brightest = std::max(brightest, p);
    }
  }
  if (!(scales.peak > 0.0)) {
    scales.peak = brightest > 0.0f ? brightest : 1.0;
    scales.peak_of_training = false;
  }
  scales.limit_percent = round_above(usual_magnitude(report.pictures, scales.peak));
  return scales;
}

PageScale brightness_scale(const Scales& scales, double range_db) {
  PageScale scale;
  scale.name = "Truth and prediction: power (dB)";
  scale.strip = Image<Colour>(1, kScaleSteps);
  for (int n = 0; n < kScaleSteps; ++n) {
    const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * n / (kScaleSteps - 1)));
    scale.strip(0, n) = {grey, grey, grey};
  }
  if (!(scales.white > 0.0f)) {
    scale.labels = {"nothing above zero"};
    return scale;
  }
  const double white_db = level_db(scales.white, Quantity::power);
  for (const double share : {1.0, 0.5, 0.0}) {
    scale.labels.push_back(decimal(white_db - share * range_db, 1));
  }
  scale.labels.front() = "≤ " + scale.labels.front();
  scale.labels.back() = "≥ " + scale.labels.back();
  return scale;
}

PageScale difference_scale(const Scales& scales) {
  PageScale scale;
  scale.name = "Difference: prediction − truth (% of the peak)";
  Image<float> values(1, kScaleSteps);
  for (int n = 0; n < kScaleSteps; ++n)
    values(0, n) = 2.0f * float(n) / float(kScaleSteps - 1) - 1.0f;
  scale.strip = signed_colours(values, 1.0f);
  const std::string limit = significant(scales.limit_percent, 3);
  scale.labels = {"≤ −" + limit, "0", "≥ +" + limit};
  return scale;
}

std::string place_of(const ReportView& view) {
  return "azimuth " + degrees(view.azimuth_deg) + ", incidence " + degrees(view.incidence_deg);
}

PagePictures view_pictures(const ReportPictures& pictures, const Scales& scales, double range_db) {
  const std::string place = place_of(pictures.view);
  DisplayRange range;
  range.range_db = range_db;
  const auto grey = [&](const Image<float>& power) {
    return display_levels(power, Quantity::power, scales.white, range);
  };
  const Image<float> difference = difference_percent(pictures, scales.peak);
  PagePictures block;
  block.pictures = {
      {grey(pictures.truth), "Truth", "Truth at " + place + ", power in decibels"},
      {grey(pictures.prediction), "Prediction", "Prediction at " + place + ", power in decibels"},
      {signed_colours(difference, static_cast<float>(scales.limit_percent)), "Difference",
       "Prediction minus truth at " + place}};
  block.caption = (pictures.held_out ? "Held-out view: " : "Training view: ") + place;
  const std::string scores = scores_in_words(pictures.scores);
  if (!scores.empty()) block.caption += " — " + scores;
  block.caption += '.';
  return block;
}

}  // namespace

std::vector<PageBlock> picture_blocks(const TrainingReport& report) {
  if (report.pictures.empty()) return {};
  for (const ReportPictures& pictures : report.pictures) check(pictures);
  const Scales scales = scales_of(report);
  std::vector<PageBlock> blocks;
  blocks.push_back(PageParagraph{
      "Rows run along azimuth, columns along slant range with near range on the left. All pictures "
      "share these two "
      "scales. Decibels are those of the image's power; what is not above zero is black. "
      "Differences are linear in "
      "power, relative to " +
      std::string(scales.peak_of_training ? "the brightest pixel of the training images"
                                          : "the brightest pixel of the truths shown") +
      ": blue where the prediction is too dark, orange where it is too bright."});
  blocks.push_back(
      PageScales{{brightness_scale(scales, report.display_range_db), difference_scale(scales)}});
  for (const ReportPictures& pictures : report.pictures) {
    blocks.push_back(view_pictures(pictures, scales, report.display_range_db));
  }
  return blocks;
}

namespace {

/// Curves whose last time exceeds this multiple of the first are drawn over a logarithmic time axis.
constexpr double kLogSpan = 20.0;

/// Curves of more points have no markers, which would hide the lines.
constexpr std::size_t kMostMarkedPoints = 25;

/// The grey of the palette, for marks that only aid reading.
constexpr int kGrey = 6;

bool drawable(double value) { return std::isfinite(value) && std::abs(value) < 1e9; }

/// A baseline has one colour in all plots, given by its index. Other series have number of baselines + `after` as index.
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

/// Means over the views of each angle, in the order of angles; bars where several views have the same angle.
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

/// Draws marks along the lower border, and lowers the lower limit to make room for them.
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
  // The model comes first in the legend. It is emphasised, so it is still drawn above the others.
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
