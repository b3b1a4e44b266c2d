// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>

#include "extraction.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/report/page.h"

namespace sarnerf::bench {

std::vector<ExtractionGroup> groups_of(const std::vector<ExtractionRun>& runs) {
  std::vector<ExtractionGroup> groups;
  for (const ExtractionRun& run : runs) {
    const auto same = [&](const ExtractionGroup& g) {
      return g.scene == run.scene && g.method == run.method && g.views.text() == run.views.text() && g.planned_s == run.planned_s;
    };
    auto group = std::ranges::find_if(groups, same);
    if (group == groups.end()) group = groups.insert(groups.end(), {run.scene, run.method, run.views, run.planned_s, {}});
    if (run.failed.empty()) group->ended.push_back(&run);
  }
  return groups;
}

Spread spread_of(const ExtractionGroup& group, ExtractionQuantity quantity) {
  std::vector<double> values;
  for (const ExtractionRun* run : group.ended)
    if (std::isfinite(run->*quantity)) values.push_back(run->*quantity);
  if (values.empty()) return {};
  double sum = 0.0;
  for (const double value : values) sum += value;
  const auto [least, most] = std::ranges::minmax(values);
  return {sum / static_cast<double>(values.size()), least, most};
}

namespace {

std::string cell(const Spread& s, int digits) {
  if (!std::isfinite(s.mean)) return "-";
  return format("%.*f", digits, s.mean) +
         (s.least < s.most ? format(" (%.*f to %.*f)", digits, s.least, digits, s.most) : std::string());
}

/// What is measured of a run, as extraction.json calls it.
struct Number {
  const char* name;
  ExtractionQuantity quantity;
};
constexpr Number kNumbers[] = {{"training_s", &ExtractionRun::training_s},
                               {"extraction_s", &ExtractionRun::extraction_s},
                               {"iou", &ExtractionRun::iou},
                               {"symmetric_difference_m", &ExtractionRun::difference_m},
                               {"visible_chamfer_m", &ExtractionRun::chamfer_m},
                               {"visible_hausdorff_m", &ExtractionRun::hausdorff_m},
                               {"carving_iou", &ExtractionRun::carving_iou},
                               {"carving_symmetric_difference_m", &ExtractionRun::carving_difference_m},
                               {"carving_visible_chamfer_m", &ExtractionRun::carving_chamfer_m}};

nlohmann::json json_of(const ExtractionRun& run) {
  nlohmann::json j{{"scene", run.scene},
                   {"method", run.method},
                   {"azimuths", run.views.n_azimuth},
                   {"pitches", run.views.n_pitch},
                   {"views", run.views.count()},
                   {"planned_s", run.planned_s},
                   {"seed", run.seed}};
  if (!run.failed.empty()) {
    j["failed"] = run.failed;
    return j;
  }
  for (const auto& [name, quantity] : kNumbers) j[name] = run.*quantity;
  return j;
}

}  // namespace

std::string extraction_table(const std::vector<ExtractionRun>& runs) {
  std::vector<TableColumn> columns{{"scene"}, {"method"}};
  for (const char* heading : {"views", "planned (s)", "training (s)", "extraction (s)", "IoU", "carving's",
                              "difference (m)", "visible Chamfer (m)", "Hausdorff (m)"})
    columns.push_back({heading, Align::right});
  std::vector<std::vector<std::string>> rows;
  for (const ExtractionGroup& g : groups_of(runs)) {
    const auto of = [&](ExtractionQuantity quantity, int digits) { return cell(spread_of(g, quantity), digits); };
    rows.push_back({g.scene, g.method, std::to_string(g.views.count()), format("%g", g.planned_s), of(&ExtractionRun::training_s, 1),
                    of(&ExtractionRun::extraction_s, 1), of(&ExtractionRun::iou, 3), of(&ExtractionRun::carving_iou, 3),
                    of(&ExtractionRun::difference_m, 3), of(&ExtractionRun::chamfer_m, 3), of(&ExtractionRun::hausdorff_m, 2)});
  }
  return markdown_table(columns, rows);
}

nlohmann::json extraction_json(const std::vector<ExtractionRun>& runs) {
  nlohmann::json list = nlohmann::json::array();
  for (const ExtractionRun& run : runs) list.push_back(json_of(run));
  return {{"runs", list}};
}

std::vector<ExtractionRun> read_extraction_runs(const std::filesystem::path& file) {
  std::ifstream in(file);
  const nlohmann::json study = nlohmann::json::parse(in, nullptr, false);
  std::vector<ExtractionRun> runs;
  try {
    for (const nlohmann::json& j : study.at("runs")) {
      if (j.contains("failed")) continue;
      ExtractionRun run;
      run.scene = j.at("scene").get<std::string>();
      run.method = j.at("method").get<std::string>();
      run.views = {j.at("azimuths").get<int>(), j.at("pitches").get<int>()};
      run.planned_s = j.at("planned_s").get<double>();
      run.seed = j.at("seed").get<std::uint64_t>();
      for (const auto& [name, quantity] : kNumbers)
        if (j.contains(name) && j.at(name).is_number()) run.*quantity = j.at(name).get<double>();
      runs.push_back(std::move(run));
    }
  } catch (const nlohmann::json::exception&) {
    throw InputError(file.string() + ": expected the extraction.json of a study, found something else; --beside takes what sar_bench "
                                     "extraction writes");
  }
  return runs;
}

namespace {

/// A quantity of the extracted body and of carving alone.
struct Measure {
  const char* name;  ///< of files
  const char* label;
  ExtractionQuantity of_body, of_carving;
};
constexpr Measure kMeasures[] = {
    {"difference", "volume of the errors over true area (m)", &ExtractionRun::difference_m, &ExtractionRun::carving_difference_m},
    {"chamfer", "visible surface: Chamfer distance (m)", &ExtractionRun::chamfer_m, &ExtractionRun::carving_chamfer_m}};

PlotPoint point(double x, const Spread& y) {
  if (y.least == y.most) return {x, y.mean, {}, {}};
  return {x, y.mean, y.least, y.most};
}

using Groups = std::vector<ExtractionGroup>;

/// A series for each different `name` of the groups, in the order of the groups.
std::vector<PlotSeries> series_of(const Groups& groups, const Measure& measure,
                                  const std::function<std::string(const ExtractionGroup&)>& name,
                                  const std::function<double(const ExtractionGroup&)>& x) {
  std::vector<PlotSeries> all;
  for (const ExtractionGroup& group : groups) {
    const Spread y = spread_of(group, measure.of_body);
    const double at = x(group);
    if (!std::isfinite(y.mean) || !std::isfinite(at)) continue;
    auto series = std::ranges::find(all, name(group), &PlotSeries::name);
    if (series == all.end()) {
      series = all.insert(all.end(), PlotSeries{});
      series->name = name(group);
    }
    series->points.push_back(point(at, y));
  }
  for (PlotSeries& series : all) std::ranges::sort(series.points, {}, &PlotPoint::x);
  return all;
}

Plot frame(const std::string& scene, const Measure& measure, const char* x_label) {
  Plot plot;
  plot.title = scene + ": what is extracted, against the truth";
  plot.x = {x_label, AxisScale::log, {}, {}};
  plot.y = {measure.label, AxisScale::linear, {}, {}};
  return plot;
}

Plot against_seconds(const std::string& scene, const Groups& groups, const Measure& measure) {
  Plot plot = frame(scene, measure, "training (s), the program's start included");
  plot.subtitle = "each point a training planned for its time";
  plot.series = series_of(
      groups, measure,
      [](const ExtractionGroup& g) {
        return g.method + format(", %d views", g.views.count()) +
               (g.views.n_pitch > 1 ? format(", %d pitches", g.views.n_pitch) : std::string());
      },
      [](const ExtractionGroup& g) { return spread_of(g, &ExtractionRun::training_s).mean; });
  return plot;
}

Plot against_views(const std::string& scene, const Groups& groups, const Measure& measure) {
  Plot plot = frame(scene, measure, "training views");
  const bool pitches = std::ranges::any_of(groups, [](const ExtractionGroup& g) { return g.views.n_pitch > 1; });
  plot.subtitle = pitches ? "evenly around, at 45°; the largest sets at several pitches, 35° to 55°" : "evenly around, at 45°";
  const auto count = [](const ExtractionGroup& g) { return static_cast<double>(g.views.count()); };
  plot.series = series_of(groups, measure, [](const ExtractionGroup& g) { return g.method + format(", %g s", g.planned_s); }, count);
  std::map<int, Spread> carved;  // nearly the same for every planned time
  for (const ExtractionGroup& group : groups) {
    const Spread y = spread_of(group, measure.of_carving);
    if (std::isfinite(y.mean)) carved[group.views.count()] = y;
  }
  PlotSeries carving;
  carving.name = "carving alone";
  carving.line = PlotLine::dashed;
  carving.emphasised = true;
  for (const auto& [n, y] : carved) carving.points.push_back(point(n, y));
  if (!carving.points.empty()) plot.series.push_back(carving);
  return plot;
}

}  // namespace

std::vector<std::pair<std::string, Plot>> extraction_diagrams(const std::vector<ExtractionRun>& runs) {
  std::map<std::string, Groups> scenes;
  for (const ExtractionGroup& group : groups_of(runs))
    if (!group.ended.empty()) scenes[group.scene].push_back(group);
  std::vector<std::pair<std::string, Plot>> diagrams;
  for (const auto& [scene, groups] : scenes) {
    for (const Measure& measure : kMeasures) {
      const std::string name = "extraction-" + scene + "-" + measure.name;
      for (auto& [file, plot] : {std::pair(name + "-seconds", against_seconds(scene, groups, measure)),
                                 std::pair(name + "-views", against_views(scene, groups, measure))})
        if (!plot.series.empty()) diagrams.emplace_back(file, plot);
    }
  }
  return diagrams;
}

}  // namespace sarnerf::bench
