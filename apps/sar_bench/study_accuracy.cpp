// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "reference/section_reference.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/report/page.h"
#include "sarnerf/scene/vdb_scene.h"
#include "studies.h"

namespace sarnerf::bench {

namespace {

/// Settings that are swept: numbers of elevation rays relative to the automatic one, slices a row, voxel sizes in range bins.
constexpr double kDensities[] = {0.125, 0.25, 0.354, 0.5, 0.707, 1.0, 1.414, 2.0, 2.83};
constexpr int kSlices[] = {1, 2, 3, 6, 9, 12, 18, 24, 36};
constexpr double kVoxels[] = {1.0, 0.5, 0.25};
constexpr Integrator kIntegrators[] = {Integrator::exact, Integrator::midpoint, Integrator::paper,
                                       Integrator::paper_gated};
constexpr double kTolerances[] = {0.05, 0.01, 0.002};

Accuracy measure(const Engine& engine, ViewPlan plan, const Image<float>& reference, int rounds) {
  ViewPlan silent = plan;
  silent.error.estimate = false;
  RenderedView rendered;
  const auto times = run_in_turn({[&] { engine.render(silent); }, [&] { rendered = engine.render(plan); }}, rounds);
  Accuracy a;
  a.n_elevation = plan.fan.n_elevation;
  a.n_slices = plan.n_slices;
  a.seconds = times[0].median();
  a.estimating = ratio(times[1], times[0]);
  a.error = relative_l2_error(rendered.beta0, reference);
  a.db_error = db_error_percentile(rendered.beta0, reference);
  a.estimate = rendered.error.relative;
  return a;
}

void sweep_surface(const SurfaceEngine& engine, const Acquisition& view, const Image<float>& reference,
                   int rounds, SceneAccuracy& out) {
  const ViewPlan automatic = engine.plan(view, {});
  for (const double density : kDensities) {
    for (const int slices : kSlices) {
      Sampling sampling;
      sampling.n_elevation = std::max(1, static_cast<int>(std::lround(automatic.fan.n_elevation * density)));
      sampling.n_slices = slices;
      Accuracy a = measure(engine, engine.plan(view, sampling), reference, rounds);
      a.engine = "surface";
      a.automatic = density == 1.0 && slices == automatic.n_slices;
      out.settings.push_back(a);
    }
  }
}

void sweep_voxels(const Scene& scene, const Acquisition& view, const Image<float>& reference, int rounds,
                  SceneAccuracy& out) {
  const auto voxels_of = [&](double bins) {
    VoxeliseOptions options;
    options.voxel_size_m = bins * view.range_spacing_m;
    return to_volume(voxelise(scene, options));
  };
  std::optional<Volume> coarser = voxels_of(2.0 * kVoxels[0]);
  for (const double bins : kVoxels) {
    const Volume volume = voxels_of(bins);
    const VoxelEngine engine(scene, volume, std::move(coarser));
    coarser = volume;
    for (const Integrator integrator : kIntegrators) {
      Sampling sampling;
      sampling.integrator = integrator;
      Accuracy a = measure(engine, engine.plan(view, sampling), reference, rounds);
      a.engine = "voxel";
      a.voxel_bins = bins;
      a.integrator = name(integrator);
      out.settings.push_back(a);
    }
  }
}

void try_tolerances(const SurfaceEngine& engine, const Acquisition& view, const Image<float>& reference,
                    int rounds, SceneAccuracy& out) {
  for (const double tolerance : kTolerances) {
    TolerantView found;
    std::vector<ToleranceStep> steps;
    const auto times = run_in_turn({[&] {
      ToleranceChoice choice = choose_sampling(engine, view, tolerance);
      steps = std::move(choice.steps);
      if (choice.met) {
        found = std::move(*choice.met);
        return;
      }
      found = render_to_tolerance(engine, engine.plan(view, choice.sampling), tolerance);
      steps.insert(steps.end(), found.steps.begin(), found.steps.end());
    }}, rounds);
    ToleranceResult result;
    for (const ToleranceStep& step : steps) result.n_rays += double(step.n_elevation) * step.n_slices;
    result.tolerance = tolerance;
    result.n_elevation = found.plan.fan.n_elevation;
    result.n_slices = found.plan.n_slices;
    result.n_renders = static_cast<int>(steps.size());
    result.seconds = times[0].median();
    result.estimate = found.view.error.relative;
    result.error = relative_l2_error(found.view.beta0, reference);
    for (const Accuracy& a : out.settings) {
      if (a.error > tolerance || a.engine != "surface") continue;
      result.best_s = std::fmin(result.best_s, a.seconds);
      result.best_n_rays = std::fmin(result.best_n_rays, double(a.n_elevation) * a.n_slices);
    }
    out.tolerances.push_back(result);
  }
}

/// Scenes with few faces get more slices, because the ends of faces fall between slices. The reference is right to
/// 1e-4 or better.
int reference_slices(const Scene& scene) { return scene.mesh.triangles.size() < 500 ? 512 : 128; }

}  // namespace

std::vector<SceneAccuracy> study_accuracy(const StudyOptions& options) {
  const ThreadLimit one_thread(1);
  std::vector<SceneAccuracy> results;
  for (const NamedScene& named : load_scenes(options)) {
    SceneAccuracy out;
    out.scene = named.name;
    const SurfaceEngine engine(named.scene);
    const Acquisition view = standard_view(named.scene, options);
    const Image<float> reference = section_reference(named.scene, view, reference_slices(named.scene));
    sweep_surface(engine, view, reference, options.rounds, out);
    if (!options.quick) sweep_voxels(named.scene, view, reference, options.rounds, out);
    try_tolerances(engine, view, reference, options.rounds, out);
    results.push_back(std::move(out));
  }
  return results;
}

namespace {

nlohmann::json json_of(const Accuracy& a) {
  nlohmann::json j{{"engine", a.engine},
                   {"elevations", a.n_elevation},
                   {"sub_rows", a.n_slices},
                   {"automatic", a.automatic},
                   {"ms", a.seconds * 1e3},
                   {"error", a.error},
                   {"db_error_p95", a.db_error},
                   {"estimate", a.estimate},
                   {"estimating_over_not", a.estimating}};
  if (a.voxel_bins > 0.0) {
    j["voxel_bins"] = a.voxel_bins;
    j["integrator"] = a.integrator;
  }
  return j;
}

nlohmann::json json_of(const ToleranceResult& t) {
  return {{"tolerance", t.tolerance},     {"elevations", t.n_elevation}, {"sub_rows", t.n_slices},
          {"renders", t.n_renders},       {"ms", t.seconds * 1e3},       {"estimate", t.estimate},
          {"error", t.error},             {"best_ms", t.best_s * 1e3},   {"time_over_best", t.seconds / t.best_s},
          {"rays_over_best", t.n_rays / t.best_n_rays}};
}

}  // namespace

nlohmann::json accuracy_json(const std::vector<SceneAccuracy>& results) {
  nlohmann::json scenes = nlohmann::json::array();
  std::size_t n_estimates = 0, n_good = 0, n_tolerances = 0, n_met = 0, n_cheap = 0;
  for (const SceneAccuracy& scene : results) {
    nlohmann::json settings = nlohmann::json::array(), tolerances = nlohmann::json::array();
    for (const Accuracy& a : scene.settings) {
      settings.push_back(json_of(a));
      if (a.integrator != "exact" || std::isnan(a.estimate)) continue;
      ++n_estimates;
      n_good += a.estimate >= 0.5 * a.error && a.estimate <= 3.0 * a.error;
    }
    for (const ToleranceResult& t : scene.tolerances) {
      tolerances.push_back(json_of(t));
      ++n_tolerances;
      n_met += t.error <= t.tolerance;
      n_cheap += t.seconds <= 2.0 * t.best_s;
    }
    scenes.push_back({{"scene", scene.scene}, {"settings", settings}, {"tolerances", tolerances}});
  }
  return {{"scenes", scenes},
          {"estimates", {{"renders", n_estimates}, {"between_half_and_three_times_the_error", n_good}}},
          {"tolerances", {{"asked", n_tolerances}, {"met", n_met}, {"within_twice_the_best_time", n_cheap}}}};
}

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

/// The setting of the surface engine with these numbers of rays and slices relative to the automatic one; null if
/// there is none.
const Accuracy* find(const SceneAccuracy& scene, double rays, double slices) {
  const auto automatic = std::ranges::find_if(scene.settings, &Accuracy::automatic);
  if (automatic == scene.settings.end()) return nullptr;
  const Accuracy* best = nullptr;
  double least = 0.02;  // rays are whole numbers
  for (const Accuracy& a : scene.settings) {
    if (a.engine != "surface" || a.n_slices != static_cast<int>(automatic->n_slices * slices + 0.5)) continue;
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
