// SPDX-License-Identifier: Apache-2.0
#include "accuracy_diagram.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "sarnerf/core/format.h"
#include "sarnerf/report/table.h"

namespace sarnerf::bench {
namespace {

PlotPoint point(const Accuracy& a) { return {a.seconds * 1e3, a.error * 100.0, {}, {}}; }

bool drawn(const Accuracy& a) { return a.error > 0.0 && a.seconds > 0.0; }

PlotSeries series(const SceneAccuracy& scene, const std::string& name, PlotMarker marker, PlotLine line,
                  const std::function<bool(const Accuracy&)>& wanted) {
  PlotSeries s;
  s.name = name;
  s.marker = marker;
  s.line = line;
  for (const Accuracy& a : scene.settings) {
    if (drawn(a) && wanted(a)) s.points.push_back(point(a));
  }
  return s;
}

/// Settings that no other one beats in both time and error, cheapest first.
PlotSeries pareto_front(const SceneAccuracy& scene) {
  std::vector<Accuracy> sorted;
  std::ranges::copy_if(scene.settings, std::back_inserter(sorted), drawn);
  std::ranges::sort(sorted, {}, &Accuracy::seconds);
  PlotSeries front;
  front.name = "Pareto front";
  front.marker = PlotMarker::ring;
  front.emphasised = true;
  double least = std::numeric_limits<double>::infinity();
  for (const Accuracy& a : sorted) {
    if (a.error >= least) continue;
    least = a.error;
    front.points.push_back(point(a));
  }
  return front;
}

/// Of the surface engine, the setting with these densities relative to the automatic one.
const Accuracy* find(const SceneAccuracy& scene, double rays, double slices) {
  const auto automatic = std::ranges::find_if(scene.settings, &Accuracy::automatic);
  if (automatic == scene.settings.end()) return nullptr;
  const Accuracy* best = nullptr;
  double least = 0.02;  // rays are whole numbers
  for (const Accuracy& a : scene.settings) {
    if (a.engine != "surface" || a.n_sub_rows != static_cast<int>(automatic->n_sub_rows * slices + 0.5)) continue;
    const double off = std::abs(double(a.n_elevation) / automatic->n_elevation / rays - 1.0);
    if (off < least) {
      least = off;
      best = &a;
    }
  }
  return best;
}

std::string cell(double error, double seconds) {
  return format("%.2g %% in %.3g ms", 100.0 * error, 1e3 * seconds);
}

std::string cell(const Accuracy* a) { return a == nullptr ? "" : cell(a->error, a->seconds); }

}  // namespace

Plot accuracy_diagram(const SceneAccuracy& scene) {
  Plot plot;
  plot.title = "Error against time: " + scene.scene;
  plot.subtitle = "one view, one thread; against exact visibility in double precision";
  plot.x = {"time of a view (ms)", AxisScale::log, {}, {}};
  plot.y = {"error E (%)", AxisScale::log, {}, {}};
  plot.height_px = 600.0;
  const auto voxels = [](const char* integrator) {
    return [integrator](const Accuracy& a) { return a.engine == "voxel" && a.integrator == integrator; };
  };
  plot.series.push_back(series(scene, "surface engine, rays and slices swept", PlotMarker::circle, PlotLine::none,
                               [](const Accuracy& a) { return a.engine == "surface"; }));
  plot.series.push_back(series(scene, "voxels of 1, 1/2, 1/4 bin, exact", PlotMarker::square, PlotLine::solid, voxels("exact")));
  plot.series.push_back(series(scene, "the same, midpoint", PlotMarker::triangle, PlotLine::dashed, voxels("midpoint")));
  plot.series.push_back(series(scene, "the same, paper", PlotMarker::diamond, PlotLine::dashed, voxels("paper")));
  plot.series.push_back(series(scene, "the same, paper-gated", PlotMarker::triangle_down, PlotLine::dashed, voxels("paper-gated")));
  plot.series.push_back(pareto_front(scene));
  PlotSeries tolerant;
  tolerant.name = "--error 5 %, 1 %, 0.2 %, pilots and estimates included";
  tolerant.marker = PlotMarker::cross;
  tolerant.line = PlotLine::none;
  for (const ToleranceResult& t : scene.tolerances) {
    if (t.error > 0.0) tolerant.points.push_back({t.seconds * 1e3, t.error * 100.0, {}, {}});
  }
  plot.series.push_back(tolerant);
  std::erase_if(plot.series, [](const PlotSeries& s) { return s.points.empty(); });
  for (const Accuracy& a : scene.settings) {
    if (a.automatic && drawn(a)) plot.notes.push_back({a.seconds * 1e3, a.error * 100.0, "automatic"});
  }
  return plot;
}

std::string accuracy_table(const std::vector<SceneAccuracy>& scenes) {
  std::vector<std::vector<std::string>> rows;
  for (const SceneAccuracy& scene : scenes) {
    const Accuracy* automatic = find(scene, 1.0, 1.0);
    std::vector<std::string> row{scene.scene, cell(find(scene, 0.25, 2.0 / 9.0)), cell(find(scene, 0.5, 1.0 / 3.0)),
                                 cell(automatic), cell(find(scene, 2.0, 2.0)),
                                 automatic == nullptr ? "" : format("%.2g %%", 100.0 * automatic->estimate)};
    for (const ToleranceResult& t : scene.tolerances) row.push_back(cell(t.error, t.seconds));
    rows.push_back(row);
  }
  return markdown_table({{"scene"},
                         {"1/4 rays, 2 slices"},
                         {"1/2 rays, 3 slices"},
                         {"automatic"},
                         {"2 x rays, 18 slices"},
                         {"automatic says"},
                         {"--error 5%"},
                         {"--error 1%"},
                         {"--error 0.2%"}},
                        rows);
}

}  // namespace sarnerf::bench
