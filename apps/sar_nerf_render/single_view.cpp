// SPDX-License-Identifier: Apache-2.0
#include "single_view.h"

#include <nlohmann/json.hpp>

#include "display_scale.h"
#include "model_place.h"
#include "output_files.h"
#include "output_lock.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/stopwatch.h"
#include "sarnerf/dataset/display.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf::app {
namespace {

struct Paths {
  std::filesystem::path tiff, png, report, recipe;
};

/// Whether the files of this recipe are there already. Throws UsageError for others.
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
    console.warning("the image is blank: the model holds no matter that this view sees");
  const DisplayScale scale(std::span(&white, 1));
  Json recipe = make_recipe(kProgram, job.request, {{"view", Json::parse(view_text(view))}});
  recipe["display"] = scale.text(job.quantity);
  AtomicFiles files;
  files.add(paths.tiff, encode_tiff(image));
  files.add(paths.png, make_picture(image, job.quantity, scale));
  files.add(paths.report, report_text(job, 1, render_s));
  files.add(paths.recipe, recipe_text(recipe));
  // An old recipe must not vouch for new images, should the machine stop between the renames.
  std::filesystem::remove(paths.recipe);
  files.commit();
  return result;
}

}  // namespace sarnerf::app
