// SPDX-License-Identifier: Apache-2.0
#include "study_accuracy.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/render/section_reference.h"
#include "sarnerf/render/surface_engine.h"
#include "sarnerf/render/tolerance.h"
#include "sarnerf/render/voxel_engine.h"
#include "sarnerf/scene/voxelise.h"
#include "timing.h"
#include "view.h"

namespace sarnerf::bench {
namespace {

/// Settings that are swept: ray spacings in automatic ones, slices a row, voxels in range bins.
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
  a.n_sub_rows = plan.n_sub_rows;
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
      sampling.n_sub_rows = slices;
      Accuracy a = measure(engine, engine.plan(view, sampling), reference, rounds);
      a.engine = "surface";
      a.automatic = density == 1.0 && slices == automatic.n_sub_rows;
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
    for (const ToleranceStep& step : steps) result.n_rays += double(step.n_elevation) * step.n_sub_rows;
    result.tolerance = tolerance;
    result.n_elevation = found.plan.fan.n_elevation;
    result.n_sub_rows = found.plan.n_sub_rows;
    result.n_renders = static_cast<int>(steps.size());
    result.seconds = times[0].median();
    result.estimate = found.view.error.relative;
    result.error = relative_l2_error(found.view.beta0, reference);
    for (const Accuracy& a : out.settings) {
      if (a.error > tolerance || a.engine != "surface") continue;
      result.best_s = std::fmin(result.best_s, a.seconds);
      result.best_n_rays = std::fmin(result.best_n_rays, double(a.n_elevation) * a.n_sub_rows);
    }
    out.tolerances.push_back(result);
  }
}

/// Where faces are few, their ends fall between slices: more of them then. The reference is right to 1e-4 or better.
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

}  // namespace sarnerf::bench
