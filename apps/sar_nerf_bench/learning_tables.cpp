// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "learning_output.h"
#include "sarnerf/core/format.h"
#include "sarnerf/report/table.h"

namespace sarnerf::bench {
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
  std::vector<const LearningRun*> runs;  ///< those that came to their end
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
  // Equal quality against the paper's way, wherever that got to.
  double plain_db = -std::numeric_limits<double>::infinity();
  for (const LearningRun& run : study.runs) {
    if (run.field != "plain") continue;
    for (const LearningPoint& p : run.points) plain_db = std::max(plain_db, p.psnr_db);
  }
  if (std::isfinite(plain_db)) {
    levels_db.push_back(plain_db);
    columns.push_back({format("%.2f dB, plain's best", plain_db), Align::right});
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
