// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <limits>
#include <map>

#include "learning_output.h"

namespace sarnerf::bench {
namespace {

std::string seconds_name(double s) {
  char text[40];
  std::snprintf(text, sizeof text, "%g s", s);
  return text;
}

/// What runs of each planned time had at their end: means over seeds, with the seeds' range.
PlotSeries ends_of(const LearningStudy& study, const std::string& field) {
  struct Ends {
    double seconds = 0.0, sum_db = 0.0, n = 0.0;
    double low_db = std::numeric_limits<double>::infinity(), high_db = -low_db;
  };
  std::map<double, Ends> ends;
  for (const LearningRun& run : study.runs) {
    if (run.field != field || run.points.empty() || !run.diverged.empty()) continue;
    const LearningPoint& end = run.points.back();
    Ends& e = ends[run.planned_s];
    e.seconds += end.seconds;
    e.sum_db += end.psnr_db;
    e.n += 1.0;
    e.low_db = std::min(e.low_db, end.psnr_db);
    e.high_db = std::max(e.high_db, end.psnr_db);
  }
  PlotSeries series;
  for (const auto& [planned_s, e] : ends) {
    PlotPoint point{e.seconds / e.n, e.sum_db / e.n, {}, {}};
    if (e.n > 1.0) {
      point.y_low = e.low_db;
      point.y_high = e.high_db;
    }
    series.points.push_back(point);
  }
  return series;
}

/// The first of the longest runs, all along.
PlotSeries course_of(const LearningStudy& study, const std::string& field) {
  const LearningRun* longest = nullptr;
  for (const LearningRun& run : study.runs) {
    if (run.field == field && (longest == nullptr || run.planned_s > longest->planned_s))
      longest = &run;
  }
  PlotSeries series;
  series.name = field + ", one run planned for " + seconds_name(longest->planned_s);
  series.marker = PlotMarker::none;
  series.line = PlotLine::dashed;
  for (const LearningPoint& p : longest->points)
    series.points.push_back({p.seconds, p.psnr_db, {}, {}});
  return series;
}

}  // namespace

Plot learning_diagram(const LearningStudy& study) {
  Plot plot;
  plot.title = "Held-out PSNR against run time";
  plot.subtitle = std::to_string(study.n_training_views) + " training views, mean of " +
                  std::to_string(study.views.size()) + " unseen ones; start-up included";
  plot.x = {"time since the program's start (s)", AxisScale::log, {}, {}};
  plot.y = {"PSNR of power (dB)", AxisScale::linear, {}, {}};
  plot.height_px = 600.0;
  int colour = 0;
  for (const std::string& field : fields_of(study)) {
    PlotSeries ends = ends_of(study, field), course = course_of(study, field);
    ends.colour = course.colour = colour++;
    if (ends.points.size() > 1) {
      ends.name = field + ", each run planned for its time";
      plot.series.push_back(ends);
    } else {
      course.line = PlotLine::solid;
      course.marker = PlotMarker::automatic;
    }
    if (!course.points.empty()) plot.series.push_back(course);
  }
  double first_s = std::numeric_limits<double>::infinity(), last_s = 0.0;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& p : series.points) {
      first_s = std::min(first_s, p.x);
      last_s = std::max(last_s, p.x);
    }
  }
  const auto* best = best_baseline(study);
  if (best != nullptr && last_s > 0.0) {
    PlotSeries level;
    level.name = "interpolation: " + best->first;
    level.marker = PlotMarker::none;
    level.emphasised = true;
    level.points = {{first_s, best->second, {}, {}}, {last_s, best->second, {}, {}}};
    plot.series.push_back(level);
  }
  return plot;
}

}  // namespace sarnerf::bench
