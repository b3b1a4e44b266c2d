// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "console.h"
#include "engine_choice.h"
#include "formation.h"
#include "memory_limit.h"
#include "options.h"
#include "recipe.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/core/stopwatch.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/render/tolerance.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf::app {

/// Wall-clock seconds of the stages that come before rendering.
struct PreparationTimes {
  double load_s = 0.0;
  double build_s = 0.0;
  double plan_s = 0.0;
};

/// Everything decided and built, nothing rendered.
struct Job {
  Options options;
  std::unique_ptr<const Scene> scene;  ///< the engine refers to it
  BuiltEngine built;
  glm::dvec3 aim_m{0.0};
  double reference_height_m = 0.0;  ///< of the plane that calibration refers to
  std::string framing;              ///< how the size was chosen; empty when it was given
  std::vector<DatasetView> views;   ///< image names still empty
  std::optional<ToleranceChoice> tolerance;  ///< what --error led to
  std::vector<ViewPlan> plans;      ///< one per view, each of an image wider by `border` on every side
  Border border;                    ///< zero unless there is an impulse response
  MemoryLimit memory_limit;         ///< from before anything was loaded
  std::uint64_t memory_bytes = 0;   ///< expected at the peak
  int n_views_at_once = 1;
  PreparationTimes times;
};

/// Loads the scene, frames it, builds the engine and plans every view. Tells the console what was
/// mended, assumed or chosen. Throws UsageError for what --max-memory does not allow, before it is
/// allocated, and what loading and planning throw.
Job prepare(const Options& options, Console& console, const Monitor& monitor);

/// Rays and expected tracing time, summed over the planned views.
struct PlannedCost {
  std::uint64_t n_grid_rays = 0, n_kept_rays = 0;
  double expected_s = 0.0;        ///< of rendering
  double expected_files_s = 0.0;  ///< of making files, all views
};
PlannedCost planned_cost(const Job& job);

/// What the program chose: the "resolved" part of a recipe.
Json resolved_of(const Job& job);

}  // namespace sarnerf::app
