// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include <nlohmann/json.hpp>

#include "job.h"
#include "output_files.h"
#include "output_lock.h"
#include "recipe_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/image_file.h"
#include "torch_setup.h"

namespace sarnerf::app {

namespace {

struct Paths {
  std::filesystem::path tiff, png, report, recipe;
};

/// Whether the files of this recipe exist already. Throws UsageError for other files.
bool finished(const Paths& paths, const Json& request) {
  const auto refuse = [&](const std::string& why) {
    throw UsageError(paths.tiff.string() + ": other output is in the way (" + why +
                     "); choose another name (-o) or allow --overwrite");
  };
  if (const auto recipe = read_recipe(paths.recipe)) {
    const std::string differs = difference(recipe->value("request", Json()), request);
    if (!differs.empty()) refuse(differs);
    return std::filesystem::exists(paths.tiff) && std::filesystem::exists(paths.png);
  }
  for (const auto& path : {paths.tiff, paths.png, paths.recipe}) {
    if (std::filesystem::exists(path)) refuse(path.filename().string() + " without a recipe");
  }
  return false;
}

}  // namespace

std::string write_single_view(const Job& job, Console& console, const Monitor& monitor) {
  const auto base = image_base(job.options.output, model_name(job.options.model) + "_view");
  const Paths paths{with_ending(base, ".tif"), with_ending(base, ".png"),
                    with_ending(base, ".report.json"), with_ending(base, ".json")};
  const std::vector<std::filesystem::path> inputs{model_file(job.options.model),
                                                  job.options.shared.config_file};
  for (const auto& path : {paths.tiff, paths.png, paths.report, paths.recipe}) {
    refuse_input(path, inputs);
    if (std::filesystem::is_directory(path))
      throw UsageError(path.string() +
                       ": expected a place for a file, found a folder; choose another -o");
  }
  const auto folder = paths.tiff.parent_path();
  require_possible(folder.empty() ? "." : folder);
  if (!folder.empty()) make_folder(folder);
  const OutputLock lock({paths.tiff, paths.png, paths.report, paths.recipe});
  const std::string result =
      paths.tiff.string() + "\n" + paths.png.string() + "\n" + paths.recipe.string() + "\n";
  if (!job.options.overwrite && finished(paths, job.request)) {
    console.note("already done: the same recipe is there, nothing was rendered");
    return result;
  }

  DatasetView view = job.views.front();
  view.image = paths.tiff.filename().string();
  const Stopwatch rendering;
  const Image<float> image = make_image(job, view);
  const double render_s = rendering.seconds();
  monitor.check();
  const float white = white_level(image);
  if (white <= 0.0f)
    console.warning("the image is blank: the model has no occupied voxels that this view sees");
  const DisplayScale scale(std::span(&white, 1));
  Json recipe = make_recipe(kProgram, job.request, {{"view", Json::parse(view_text(view))}});
  recipe["display"] = scale.text(job.quantity);
  AtomicFiles files;
  files.add(paths.tiff, encode_tiff(image));
  files.add(paths.png, make_picture(image, job.quantity, scale));
  files.add(paths.report, report_text(job, 1, render_s));
  files.add(paths.recipe, recipe_text(recipe));
  // If the machine stops between the renames, no old recipe must stand beside new images.
  std::filesystem::remove(paths.recipe);
  files.commit();
  return result;
}

namespace {

std::string manifest_of(const Job& job, const std::vector<DatasetView>& views,
                        const std::vector<char>& finished, const Json& display) {
  const ModelInfo& info = job.model.info;
  Dataset dataset;
  dataset.quantity = job.quantity;
  dataset.calibration = info.calibration;
  dataset.aim_m = info.aim_m;
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (finished[n]) dataset.views.push_back(views[n]);
  }
  dataset.resolution = job.model.field->resolution;
  dataset.scene_box_m = scene_box_of_swath(info.aim_m, dataset.views);
  Json provenance{
      {"program", make_recipe(kProgram, Json::object(), Json::object()).at("program")},
      {"recipe", "recipe.json"},
      {"model", job.request.at("model")},
      {"learned_from", {{"sha256", info.dataset_sha256}, {"views", info.training_views.size()}}}};
  if (!display.is_null()) provenance["display"] = display;
  if (dataset.views.size() < views.size()) dataset.n_planned_views = views.size();
  dataset.exact_poses = true;
  dataset.provenance_json = provenance.dump();
  return manifest_text(dataset);
}

}  // namespace

std::string write_sweep(const Job& job, Console& console, const Monitor& monitor) {
  std::filesystem::path place =
      job.options.output.empty() ? model_name(job.options.model) + "_views" : job.options.output;
  if (!place.has_filename()) place = place.parent_path();
  const std::size_t n_views = job.views.size();
  const SweepFolder folder(place, n_views);
  require_sweep_place(folder, job.request, job.options.overwrite);
  make_folder(folder.path());
  const FolderLock lock(folder.path());
  folder.remove_temporary_files();
  take_sweep_place(folder, make_recipe(kProgram, job.request, Json::object()), job.options.overwrite);
  folder.create(false);

  std::vector<DatasetView> views = job.views;
  std::vector<char> finished(n_views, 0);
  Checksums checksums(folder.checksums());
  for (std::size_t n = 0; n < n_views; ++n) {
    views[n].image = folder.image_name(n);
    finished[n] =
        checksums.whole(folder.image_name(n)) && checksums.whole(folder.png_name(n)) ? 1 : 0;
  }
  const auto n_before = static_cast<std::size_t>(std::count(finished.begin(), finished.end(), 1));
  const std::string result = folder.manifest().string() + "\n";
  if (n_before == n_views && folder.described(n_views)) {
    console.note("already done: all " + std::to_string(n_views) +
                 " views of the same recipe are there, nothing was rendered");
    return result;
  }
  if (n_before > 0)
    console.note("continuing: " + std::to_string(n_before) + " of " + std::to_string(n_views) +
                 " views are there");

  const Stopwatch rendering;
  Json display;
  std::map<std::size_t, Image<float>>
      held;  // rendered for the pictures' scale, written later in order
  try {
    std::vector<float> whites;
    for (const std::size_t n : DisplayScale::sample_views(n_views)) {
      monitor.check();
      if (finished[n]) {
        whites.push_back(white_level(read_image(folder.tiff(n))));
      } else {
        whites.push_back(white_level(held.emplace(n, make_image(job, views[n])).first->second));
      }
    }
    const DisplayScale scale(whites);
    display = scale.text(job.quantity);
    std::size_t n_done = 0;
    for (std::size_t n = 0; n < n_views; ++n) {
      if (finished[n]) continue;
      monitor.check();
      const auto found = held.find(n);
      const Image<float> image =
          found != held.end() ? std::move(found->second) : make_image(job, views[n]);
      const auto tiff = encode_tiff(image), png = make_picture(image, job.quantity, scale);
      write_view_files(folder, {{folder.png_name(n), png}, {folder.image_name(n), tiff}}, checksums);
      finished[n] = 1;
      monitor.report("views", ++n_done, n_views - n_before);
    }
  } catch (const Interrupted&) {
    const auto n_now = std::count(finished.begin(), finished.end(), 1);
    if (n_now > 0)
      write_file_atomically(folder.manifest(), manifest_of(job, views, finished, display));
    throw Interrupted("interrupted: " + std::to_string(n_now) + " of " + std::to_string(n_views) +
                      " views are finished; the same command continues");
  }
  checksums.finish();
  write_file_atomically(folder.manifest(), manifest_of(job, views, finished, display));
  write_file_atomically(folder.report(), report_text(job, n_views - n_before, rendering.seconds()),
                        Durability::process);
  console.note("finished: " + std::to_string(n_views) + " views");
  return result;
}

}  // namespace sarnerf::app
