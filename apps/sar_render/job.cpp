// SPDX-License-Identifier: Apache-2.0
#include "job.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <tuple>

#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/numbers.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/units.h"
#include "sarnerf/render/framing.h"

namespace sarnerf::app {

namespace {

/// Whether an option has an effect on a job, and if not, why.
struct Rule {
  const char* option;
  bool matters;
  const char* why_not;
};

bool has_media(const Scene& scene) {
  return std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) { return !m.opaque; });
}

/// Whether anything refers to the reference plane; if not, its height has no effect.
bool uses_reference_plane(const Job& job) {
  const Options& o = job.options;
  const bool in_layers = o.layers.has(Layer::mask) || o.layers.has(Layer::elevation);
  return job.scene->ground || in_layers || o.calibration != Calibration::beta0 || o.formation.nesz_db;
}

}  // namespace

std::vector<std::string> unused_options(const Job& job) {
  const Options& o = job.options;
  const Rule rules[] = {
      {"integrator", job.built.voxel || has_media(*job.scene),
       "all materials are opaque, and the surface engine integrates translucent ones only"},
      {"seed", o.formation.speckle(), "there is no speckle (--looks)"},
      {"voxel-size", job.built.voxel, "no voxels are made"},
      {"extinction-per-density", job.is_fog, "it is for fog volumes (.vdb) of other tools, and the scene is none"},
      {"materials", !o.volume() || job.scene->ground, "a volume (.vdb) has its own, and there is no ground (--ground) to take one"},
      {"ground-height", uses_reference_plane(job),
       "there is no ground (--ground), and nothing else refers to the reference plane (--calibration, --nesz, --layers)"},
  };
  std::vector<std::string> lines;
  for (const Rule& rule : rules) {
    if (!rule.matters && o.given.contains(rule.option))
      lines.push_back(std::string("--") + rule.option + " has no effect: " + rule.why_not);
  }
  return lines;
}

namespace {

/// Sides that an automatic size is not cut below.
constexpr int kSmallestSide = 16;

/// Time to encode and write image and picture, measured at 128 million pixels, on one core.
constexpr double kFileSecondsPerPixel = 35e-9;

LoadOptions load_options(const Options& o, const MemoryLimit& limit, const Monitor& monitor) {
  LoadOptions load;
  load.up = o.up;
  load.units_m = o.units_m;
  load.scale = o.scale;
  load.materials_file = o.materials;
  load.ground_material = o.ground;
  load.ground_height_m = o.ground_height_m;
  load.max_memory_bytes = limit.bytes;
  load.monitor = monitor;
  return load;
}

/// Views of every combination of angles, all azimuths of the first incidence first. Their sizes are set later.
std::vector<Acquisition> acquisitions(const Options& o, const glm::dvec3& aim_m) {
  std::vector<Acquisition> views;
  views.reserve(o.incidence_deg.size() * o.azimuth_deg.size());
  for (const double incidence_deg : o.incidence_deg) {
    Acquisition view;
    view.incidence_rad = rad_from_deg(incidence_deg);
    view.slant_range_m = o.slant_range_m.value_or(slant_range_from_altitude_m(o.altitude_m, view.incidence_rad));
    view.aim_m = aim_m;
    view.look = o.look;
    view.azimuth_spacing_m = o.spacing_m.first;
    view.range_spacing_m = o.spacing_m.second;
    for (const double azimuth_deg : o.azimuth_deg) {
      view.azimuth_rad = rad_from_deg(azimuth_deg);
      views.push_back(view);
    }
  }
  return views;
}

void set_size(Job& job) {
  if (!job.options.size) {
    Framing framing = frame_scene(*job.scene, job.views, job.reference_height_m);
    job.framing = "the size " + std::move(framing.explanation);
    job.options.size = {framing.n_azimuth, framing.n_range};
    // Near the radar the border of an impulse response needs ranges above zero, too.
    double nearest_m = job.views.front().slant_range_m;
    for (const Acquisition& view : job.views) nearest_m = std::min(nearest_m, view.slant_range_m);
    const int most = static_cast<int>(std::min(2.0 * nearest_m / job.options.spacing_m.second, 1e6)) - 1 - 2 * border_of(job.options).range;
    if (most >= kSmallestSide && job.options.size->second > most) {
      job.options.size->second = most;
      job.framing += "; cut at " + std::to_string(most) + " bins, where the border of the impulse response reaches the radar";
    }
  }
  for (Acquisition& view : job.views) {
    std::tie(view.n_azimuth, view.n_range) = *job.options.size;
  }
}

/// Reports the size that was chosen, unless a plan will, and gives advice on an image that is large, small or shows little.
void tell_size(const Job& job, Console& console) {
  const Options& o = job.options;
  const auto [n_azimuth, n_range] = *o.size;
  char text[200];
  if (!job.framing.empty() && !o.explain) {
    std::snprintf(text, sizeof text, "%d x %d pixels (azimuth x range): ", n_azimuth, n_range);
    console.note(text + job.framing);
  }
  const std::string few = few_pixels_warning(*job.scene, job.views.front());
  if (!few.empty()) {
    console.warning(few);
    return;
  }
  constexpr int kLarge = 4096, kSmall = 64, kGood = 128;
  if (!job.framing.empty() && !job.scene->box.empty() && std::max(n_azimuth, n_range) > kLarge) {
    console.note("a large image: " + scene_size_hint(*job.scene));
    return;
  }
  if (job.framing.empty() || job.scene->box.empty() || std::min(n_azimuth, n_range) >= kSmall) return;
  const double finer_m = std::min(o.spacing_m.first, o.spacing_m.second);
  const double spacing_m = round_below(finer_m * std::min(n_azimuth, n_range) / kGood).value();
  std::snprintf(text, sizeof text,
                "a small image: --spacing %.6g would give about %.0f x %.0f pixels (and --units or --scale "
                "may be missing)",
                spacing_m, n_azimuth * o.spacing_m.first / spacing_m, n_range * o.spacing_m.second / spacing_m);
  console.note(text);
}

double reference_height_m(const Options& o, const Scene& scene) {
  if (o.ground_height_m) return *o.ground_height_m;
  if (scene.ground) return scene.ground->height_m;
  return scene.box.empty() ? 0.0 : scene.box.min.y;
}

void make_plans(Job& job, const Monitor& monitor) {
  job.plans.resize(job.views.size());
  std::mutex mutex;
  std::size_t n_planned = 0;
  parallel_for(job.views.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    for (std::size_t n = begin; n < end; ++n) {
      validate(job.views[n]);
      require_calibration(job.views[n], job.reference_height_m, job.options.calibration);
      job.plans[n] = job.built.engine->plan(widened(job.views[n], job.border), job.options.sampling);
      request_layers(job.plans[n], {job.options.layers, job.reference_height_m});
    }
    const std::scoped_lock lock(mutex);
    monitor.report("planning views", n_planned += end - begin, job.views.size());
  });
}

/// Finds the sampling that --error needs, on the first view; every view checks it for itself.
void meet_tolerance(Job& job, const Monitor& monitor) {
  Options& o = job.options;
  const Acquisition first = widened(job.views.front(), job.border);
  validate(first);
  job.tolerance = choose_sampling(*job.built.engine, first, *o.tolerance, o.sampling.integrator, monitor);
  char text[160];
  std::string pilots;
  for (const ToleranceStep& step : job.tolerance->steps) {
    std::snprintf(text, sizeof text, "%s%d rays x %d slices a row had %.2g %%", pilots.empty() ? "" : ", ",
                  step.n_elevation, step.n_slices, 100.0 * step.estimate);
    pilots += text;
  }
  if (pilots.empty()) return;
  o.sampling = job.tolerance->sampling;
  std::snprintf(text, sizeof text, "%d slices a row for an error of %.3g %% or less: pilot of ", o.sampling.n_slices,
                100.0 * *o.tolerance);
  job.built.notes.push_back(text + pilots + " (--error)");
}

}  // namespace

Job prepare(const Options& options, Console& console, const Monitor& monitor) {
  Job job;
  job.options = options;
  job.memory_limit = memory_limit(options.shared);
  refuse_size_beyond_memory(options, job.memory_limit);
  for (const std::string& note : options.notes) console.note(note);
  for (const std::string& warning : options.warnings) console.warning(warning);

  const Stopwatch loading;
  std::optional<Volume> volume;
  if (options.volume()) {
    LoadedVolume loaded = load_volume(options, load_options(options, job.memory_limit, monitor), console);
    job.scene = std::make_unique<const Scene>(std::move(loaded.scene));
    job.is_fog = loaded.is_fog;
    volume = std::move(loaded.volume);
  } else {
    job.scene = std::make_unique<const Scene>(load_scene(options.scene, load_options(options, job.memory_limit, monitor)));
  }
  job.times.load_s = loading.seconds();
  job.options.indirect_inputs = job.scene->report.files;
  for (const std::string& note : job.scene->report.notes) console.note(note);
  for (const std::string& warning : job.scene->report.warnings) console.warning(warning);

  job.aim_m = options.aim_m.value_or(default_aim_m(*job.scene));
  job.reference_height_m = reference_height_m(options, *job.scene);
  job.views = acquisitions(options, job.aim_m);
  set_size(job);
  job.border = border_of(job.options);
  refuse_scene_beyond_memory(job);
  tell_size(job, console);
  monitor.check();

  const Stopwatch building;
  job.built = build_engine(options, *job.scene, std::move(volume), job.memory_limit, console, monitor);
  job.times.build_s = building.seconds();
  for (const std::string& warning : job.built.engine->warnings()) console.warning(warning);
  for (const std::string& warning : unused_options(job)) console.warning(warning);

  const Stopwatch planning;
  if (options.tolerance) meet_tolerance(job, monitor);
  make_plans(job, monitor);
  job.times.plan_s = planning.seconds();
  decide_views_at_once(job);
  char text[160];
  std::snprintf(text, sizeof text, "loaded in %.3g s, built in %.3g s, planned in %.3g s",
                job.times.load_s, job.times.build_s, job.times.plan_s);
  console.detail(text);
  return job;
}

ViewAngles angles_of(const Job& job, std::size_t n) {
  const Options& o = job.options;
  return {o.incidence_deg[n / o.azimuth_deg.size()], o.azimuth_deg[n % o.azimuth_deg.size()]};
}

DatasetView manifest_view(const Job& job, std::size_t n, const std::string& image) {
  const Acquisition& a = job.views[n];
  const ViewAngles angles = angles_of(job, n);
  DatasetView view;
  view.image = image;
  view.azimuth_deg = angles.azimuth_deg;
  view.incidence_deg = angles.incidence_deg;
  view.slant_range_m = a.slant_range_m;
  view.altitude_m = job.options.slant_range_m ? a.altitude_m() : job.options.altitude_m;
  view.n_azimuth = a.n_azimuth;
  view.n_range = a.n_range;
  view.azimuth_spacing_m = a.azimuth_spacing_m;
  view.range_spacing_m = a.range_spacing_m;
  view.look = a.look;
  return view;
}

Json resolved_of(const Job& job) {
  Json j;
  j["aim_m"] = {job.aim_m.x, job.aim_m.y, job.aim_m.z};
  j["reference_height_m"] = job.reference_height_m;
  j["size"] = {job.options.size->first, job.options.size->second};
  j["ground"] = job.scene->ground ? Json(job.scene->materials[job.scene->ground->material].name)
                                  : Json("none");
  // The request already holds the fingerprints of the files that the command line names.
  j["inputs"] = Json::array();
  for (const auto& path : job.scene->report.files) {
    if (path == job.options.scene || path == job.options.materials) continue;
    j["inputs"].push_back({{"file", path.filename().string()}, {"sha256", sha256_of_file(path)}});
  }
  j["engine"] = job.built.voxel ? "voxel" : "surface";
  if (job.built.voxel) j["voxel_size_m"] = job.built.voxel_size_m;
  j["elevations"] = Json::array();
  j["sub_rows"] = Json::array();
  for (const ViewPlan& plan : job.plans) {
    j["elevations"].push_back(plan.fan.n_elevation);
    j["sub_rows"].push_back(plan.n_slices);
  }
  if (job.options.formation.resolution_m) j["formation"] = formation_resolved(job.options, job.border);
  j["chosen"] = Json::array();
  if (!job.framing.empty()) j["chosen"].push_back(job.framing);
  for (const std::string& line : job.built.notes) j["chosen"].push_back(line);
  if (job.plans.size() == 1) {
    for (const std::string& line : job.plans.front().chosen) j["chosen"].push_back(line);
  }
  return j;
}

PlannedCost planned_cost(const Job& job) {
  PlannedCost cost;
  for (const ViewPlan& plan : job.plans) {
    cost.n_grid_rays += plan.n_grid_rays;
    cost.n_kept_rays += plan.n_kept_rays;
    cost.expected_s += plan.expected_s;
    const double n_pixels = double(job.options.size->first) * double(job.options.size->second);
    cost.expected_files_s += n_pixels * kFileSecondsPerPixel / job.n_views_at_once;
  }
  return cost;
}

}  // namespace sarnerf::app
