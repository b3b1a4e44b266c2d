// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "learning.h"
#include "sarnerf/core/text.h"
#include "sarnerf/report/page.h"

namespace sarnerf::bench {

namespace {

std::string seconds_name(double s) {
  char text[40];
  std::snprintf(text, sizeof text, "%g s", s);
  return text;
}

/// Scores at the end of the runs of each planned time: means over seeds, with the seeds' range.
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

/// The curve of the longest run, the first of several.
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

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const LearningRun& run) {
  Json points = Json::array();
  for (const LearningPoint& p : run.points)
    points.push_back({{"seconds", p.seconds},
                      {"cpu_seconds", p.cpu_seconds},
                      {"step", p.step},
                      {"psnr_power_db", p.psnr_db}});
  Json j{{"field", run.field},
         {"planned_s", run.planned_s},
         {"seed", run.seed},
         {"start_s", run.start_s},
         {"points", points}};
  if (!run.diverged.empty()) j["diverged"] = run.diverged;
  return j;
}

}  // namespace

Json learning_json(const LearningStudy& study) {
  Json baselines = Json::array(), runs = Json::array();
  for (const auto& [name, psnr_db] : study.baselines)
    baselines.push_back({{"name", name}, {"psnr_power_db", psnr_db}});
  for (const LearningRun& run : study.runs) runs.push_back(json_of(run));
  return {{"dataset", study.dataset},
          {"training_views", study.n_training_views},
          {"views", study.views},
          {"peak_power", study.peak_power},
          {"baselines", baselines},
          {"runs", runs}};
}

namespace {

constexpr double kLevels_db[] = {30.0, 35.0, 40.0, 45.0, 48.0};

std::string seconds_text(const std::optional<double>& s) {
  if (!s) return "-";
  return *s < 100.0 ? format("%.1f", *s) : format("%.0f", *s);
}

/// Runs of one field and time.
struct Group {
  std::string field;
  double planned_s = 0.0;
  std::vector<const LearningRun*> runs;  ///< those that did not diverge
};

std::vector<Group> groups_of(const LearningStudy& study) {
  std::vector<Group> groups;
  for (const LearningRun& run : study.runs) {
    const auto same = [&](const Group& g) {
      return g.field == run.field && g.planned_s == run.planned_s;
    };
    auto group = std::ranges::find_if(groups, same);
    if (group == groups.end())
      group = groups.insert(groups.end(), {run.field, run.planned_s, {}});
    if (run.diverged.empty() && !run.points.empty()) group->runs.push_back(&run);
  }
  return groups;
}

template <class Value>
double mean(const Group& group, Value&& value) {
  double sum = 0.0;
  for (const LearningRun* run : group.runs) sum += static_cast<double>(value(run->points.back()));
  return sum / static_cast<double>(group.runs.size());
}

std::string run_table(const LearningStudy& study) {
  std::vector<std::vector<std::string>> rows;
  for (const Group& g : groups_of(study)) {
    if (g.runs.empty()) {
      rows.push_back({g.field, format("%g", g.planned_s), "-", "diverged", "-", "-", "-"});
      continue;
    }
    const double psnr_db = mean(g, [](const LearningPoint& p) { return p.psnr_db; });
    double low_db = std::numeric_limits<double>::infinity(), high_db = -low_db;
    for (const LearningRun* run : g.runs) {
      low_db = std::min(low_db, run->points.back().psnr_db);
      high_db = std::max(high_db, run->points.back().psnr_db);
    }
    const std::string spread =
        g.runs.size() > 1 ? format(" (%.2f to %.2f)", low_db, high_db) : std::string();
    double start_s = 0.0;
    for (const LearningRun* run : g.runs)
      start_s += run->start_s / static_cast<double>(g.runs.size());
    rows.push_back({g.field, format("%g", g.planned_s),
                    seconds_text(mean(g, [](const LearningPoint& p) { return p.seconds; })),
                    format("%.2f", psnr_db) + spread,
                    format("%.0f", mean(g, [](const LearningPoint& p) { return p.step; })),
                    format("%.1f", start_s),
                    seconds_text(mean(g, [](const LearningPoint& p) { return p.cpu_seconds; }))});
  }
  return markdown_table({{"field", Align::left},
                         {"planned (s)", Align::right},
                         {"took (s)", Align::right},
                         {"PSNR power (dB)", Align::right},
                         {"steps", Align::right},
                         {"start-up (s)", Align::right},
                         {"processor (s)", Align::right}},
                        rows);
}

}  // namespace

std::string learning_tables(const LearningStudy& study) {
  std::vector<TableColumn> columns{{"seconds to", Align::left}};
  std::vector<double> levels_db(std::begin(kLevels_db), std::end(kLevels_db));
  for (const double level_db : kLevels_db)
    columns.push_back({format("%g dB", level_db), Align::right});
  // Time to the best score of the paper's method, whatever that was.
  double paper_db = -std::numeric_limits<double>::infinity();
  for (const LearningRun& run : study.runs) {
    if (run.field != "paper") continue;
    for (const LearningPoint& p : run.points) paper_db = std::max(paper_db, p.psnr_db);
  }
  if (std::isfinite(paper_db)) {
    levels_db.push_back(paper_db);
    columns.push_back({format("%.2f dB, paper's best", paper_db), Align::right});
  }
  std::vector<std::vector<std::string>> rows;
  for (const std::string& field : fields_of(study)) {
    std::vector<std::string> row{field};
    for (const double level_db : levels_db)
      row.push_back(seconds_text(seconds_to(study, field, level_db)));
    rows.push_back(row);
  }
  std::string text = markdown_table(columns, rows) + "\n" + run_table(study);
  if (const auto* best = best_baseline(study))
    text += "\nBest baseline: " + best->first + ", " + format("%.2f dB.", best->second) + "\n";
  return text;
}

}  // namespace sarnerf::bench
