// SPDX-License-Identifier: Apache-2.0
#include "sweep.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "folder_lock.h"
#include "layer_files.h"
#include "output_place.h"
#include "report.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/core/input_file.h"
#include "sweep_folder.h"
#include "sweep_place.h"
#include "sweep_run.h"

namespace sarnerf::app {
namespace {

std::string manifest_of(const Job& job, const Json& recipe, const std::vector<char>& images,
                        const std::optional<DisplayScale>& display) {
  Dataset dataset;
  dataset.quantity = job.options.quantity;
  dataset.calibration = job.options.calibration;
  dataset.aim_m = job.aim_m;
  for (std::size_t n = 0; n < job.views.size(); ++n) {
    if (images[n]) dataset.views.push_back(job.views[n]);
  }
  dataset.scene_box_m = scene_box_of_swath(job.aim_m, dataset.views);
  const ImageFormation& formation = job.options.formation;
  if (formation.resolution_m)
    dataset.resolution = Resolution{formation.resolution_m->first, formation.resolution_m->second, formation.window};
  Json provenance;
  provenance["program"] = recipe.at("program");
  provenance["recipe"] = "recipe.json";
  provenance["scene"] = recipe.at("request").at("scene");
  if (job.options.formation.any()) provenance["formation"] = recipe.at("request").at("formation");
  if (!job.options.layers.empty()) {
    provenance["layers"] = {{"folder", "layers"}, {"names", layers_request(job.options.layers)}};
  }
  if (display) provenance["display"] = display->text(job.options.quantity);
  if (dataset.views.size() < job.views.size()) dataset.n_planned_views = job.views.size();
  dataset.provenance_json = provenance.dump();
  return manifest_text(dataset);
}

bool file_holds(const std::filesystem::path& path, const std::string& text) {
  try {
    return read_whole_file(path) == text;
  } catch (const InputError&) {
    return false;
  }
}

std::string progress_text(const SweepRun& run) {
  return std::to_string(run.n_finished()) + " of " + counted(run.finished().size(), "view") +
         (run.n_finished() == 1 ? " is" : " are") + " finished; the same command continues";
}

}  // namespace

void check_sweep(const Options& options, const Json& request) {
  const SweepFolder folder(sweep_folder(options), 2, layer_endings(all_layers()));
  for (const auto& path : {folder.recipe(), folder.manifest(), folder.report()}) {
    refuse_input(path, options);
  }
  require_sweep_place(folder, request, options.overwrite);
}

std::string write_sweep(Job& job, const Json& request, const Stopwatch& total, Console& console,
                        const Monitor& monitor) {
  const SweepFolder folder(sweep_folder(job.options), job.views.size(), layer_endings(all_layers()));
  for (std::size_t n = 0; n < job.views.size(); ++n) job.views[n].image = folder.image_name(n);
  const Json recipe = make_recipe(kProgram, request, resolved_of(job));
  const std::string result = folder.manifest().string() + "\n";

  make_folder(folder.path());
  const FolderLock lock(folder.path());
  folder.remove_temporary_files();
  take_sweep_place(folder, recipe, job.options.overwrite);
  folder.create(!job.options.layers.empty());

  SweepRun run(job, folder);
  const std::size_t n_views = job.views.size(), n_before = run.n_finished();
  const auto manifest = [&] { return manifest_of(job, recipe, run.finished(), run.display()); };
  if (n_before == n_views && file_holds(folder.manifest(), manifest())) {
    console.note("already done: all " + counted(n_views, "view") +
                 " of the same recipe are there, nothing was rendered");
    return result;
  }
  if (n_before > 0) {
    console.note("continuing: " + std::to_string(n_before) + " of " + counted(n_views, "view") +
                 (n_before == 1 ? " is there" : " are there"));
  }

  RunFigures figures;
  try {
    figures = run.render(console, monitor);
  } catch (const Interrupted&) {
    if (run.n_finished() > 0) write_file_atomically(folder.manifest(), manifest());
    throw Interrupted("interrupted: " + progress_text(run));
  } catch (const Error&) {
    console.note(progress_text(run));
    throw;
  }
  figures.total_s = total.seconds();
  console.detail(summary(figures));
  write_file_atomically(folder.report(), report_text(job, figures), Durability::process);
  write_file_atomically(folder.manifest(), manifest());
  const std::string error = error_line(figures);
  console.note("finished: " + counted(n_views, "view") + (error.empty() ? "" : "; " + error));
  return result;
}

}  // namespace sarnerf::app
