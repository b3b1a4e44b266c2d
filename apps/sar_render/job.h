// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "console.h"
#include "options.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/manifest.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf::app {

/// Name of this program in recipes.
inline constexpr const char* kProgram = "sar_render";

/// The "request" of a recipe: every setting, and the fingerprints of the files given; known before the scene is loaded.
/// "resolved" then holds what the program chose.
Json request_of(const Options& options);

struct Job;

// These functions compare the expected memory of a job with the memory allowed (process.h). Each throws UsageError,
// with what is needed and what would fit, before anything of that size is allocated.

/// The part of a limit (0: none) that is left for voxels beside the program itself.
std::uint64_t memory_for_volume(std::uint64_t limit_bytes);

/// Check before the scene is loaded: images of the size that was requested.
void refuse_size_beyond_memory(const Options& options, const MemoryLimit& limit);

/// Check before the engine is built: scene, engine and images of the framed size.
void refuse_scene_beyond_memory(const Job& job);

/// After planning: chooses how many views are rendered at once, one per thread when there are enough
/// and memory allows it, and sets Job::memory_bytes. Many small views run best one per thread, a few
/// large ones with all threads on each.
void decide_views_at_once(Job& job);

/// The engine that renders a job, and how it was chosen.
struct BuiltEngine {
  std::unique_ptr<const Engine> engine;
  bool voxel = false;
  double voxel_size_m = 0.0;
  std::uint64_t n_voxels = 0;      ///< occupied
  double voxelise_s = 0.0;
  std::vector<std::string> notes;  ///< what was chosen, and why: for the plan
};

/// A volume file as a scene. load_volume() reports on the console what reading assumed.
struct LoadedVolume {
  Scene scene;
  Volume volume;
  bool is_fog = false;
};
LoadedVolume load_volume(const Options& options, const LoadOptions& load, Console& console);

/// Builds the engine that `options` request. `auto` takes the surface engine for meshes of homogeneous material,
/// where it is more accurate at less cost, and the voxel engine for volumes and where voxels were requested. Writes
/// --save-volume.
BuiltEngine build_engine(const Options& options, const Scene& scene, std::optional<Volume> volume,
                         const MemoryLimit& limit, Console& console, const Monitor& monitor);

/// Pixels rendered on every side of the image and cut off after its formation, so that the image's borders receive
/// the power that the impulse response spreads into them from outside. The size must be decided. Zero without an
/// impulse response.
Border border_of(const Options& options);

/// The image formation that the user requested, for recipes and provenance: only the parts that are on.
Json formation_request(const ImageFormation& formation);

/// The values that follow from it: bandwidth, sidelobes, taps.
Json formation_resolved(const Options& options, const Border& border);

/// The steps of image formation for --explain, a line each; and the steps left out, empty if there are none.
std::vector<std::string> formation_lines(const Options& options, const Border& border);
std::string formation_left_out(const ImageFormation& formation);

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
  bool is_fog = false;                 ///< see VdbScene::is_fog
  BuiltEngine built;
  glm::dvec3 aim_m{0.0};
  double reference_height_m = 0.0;  ///< of the plane that calibration refers to
  std::string framing;              ///< how the size was chosen; empty when it was given
  std::vector<Acquisition> views;   ///< all azimuths of the first incidence first
  std::optional<ToleranceChoice> tolerance;  ///< the sampling that --error chose
  std::vector<ViewPlan> plans;      ///< one per view, each of an image wider by `border` on every side
  Border border;                    ///< zero unless there is an impulse response
  MemoryLimit memory_limit;         ///< taken before anything was loaded
  std::uint64_t memory_bytes = 0;   ///< expected at the peak
  int n_views_at_once = 1;
  PreparationTimes times;
};

/// Loads the scene, frames it, builds the engine and plans every view. Reports on the console what was repaired,
/// assumed or chosen. Throws UsageError for memory that --max-memory does not allow, before it is allocated, and the
/// errors of loading and planning.
Job prepare(const Options& options, Console& console, const Monitor& monitor);

/// Angles of view n of a job (deg), as the user wrote them: 45 stays 45.
struct ViewAngles {
  double incidence_deg = 0.0, azimuth_deg = 0.0;
};
ViewAngles angles_of(const Job& job, std::size_t n);

/// View n as in dataset.json and recipes, with the name of its image.
DatasetView manifest_view(const Job& job, std::size_t n, const std::string& image);

/// Rays and expected tracing time, summed over the planned views.
struct PlannedCost {
  std::uint64_t n_grid_rays = 0, n_kept_rays = 0;
  double expected_s = 0.0;        ///< of rendering
  double expected_files_s = 0.0;  ///< of making files, all views
};
PlannedCost planned_cost(const Job& job);

/// What the program chose: the "resolved" part of a recipe.
Json resolved_of(const Job& job);

/// A line for each option that was given but has no effect on this job, with what would give it one.
std::vector<std::string> unused_options(const Job& job);

/// The plan of a job as text: what will be computed with which settings, what is left out and why, and the rays,
/// bytes and seconds expected. `place` is the path of the output.
std::string explain(const Job& job, const std::string& place);

}  // namespace sarnerf::app
