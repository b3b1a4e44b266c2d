// SPDX-License-Identifier: Apache-2.0
#include "sweep.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "recipe_file.h"
#include "output_files.h"
#include "output_lock.h"
#include "options.h"
#include "products.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf::app {
namespace {

bool finished(const ImagePaths& paths, const Options& o) {
  try {
    const Image<float> image = read_image(paths.tiff);
    const auto endings = layer_endings(o.layers);
    return std::pair(image.n_azimuth(), image.n_range()) == *o.size && std::filesystem::exists(paths.png) &&
           std::all_of(endings.begin(), endings.end(), [&](const std::string& ending) {
             return std::filesystem::exists(paths.layer(ending));
           });
  } catch (const InputError&) {
    return false;
  }
}

/// Removes the layers of the image that is being replaced: none of them should remain beside the new one.
void remove_old_layers(const ImagePaths& paths) {
  const auto old = read_recipe(paths.recipe);
  if (!old || !old->value("request", Json()).contains("layers")) return;
  std::error_code ignored;
  for (const std::string& ending : layer_endings(all_layers())) {
    std::filesystem::remove(paths.layer(ending), ignored);
  }
}

/// All files of the view.
std::vector<std::filesystem::path> outputs_of(const Options& options, const ImagePaths& paths) {
  std::vector<std::filesystem::path> outputs{paths.tiff, paths.png, paths.recipe, paths.report};
  for (const std::string& ending : layer_endings(options.layers)) outputs.push_back(paths.layer(ending));
  return outputs;
}

[[noreturn]] void refuse(const ImagePaths& paths, const std::string& why) {
  throw UsageError(paths.tiff.string() + ": other output is in the way (" + why +
                   "); choose another name (-o) or allow --overwrite");
}

}  // namespace

void check_single_view(const Options& options, const Json& request) {
  const ImagePaths paths = image_paths(options);
  std::vector<std::filesystem::path> outputs = outputs_of(options, paths);
  for (const auto& path : outputs) {
    refuse_input(path, options);
    if (std::filesystem::is_directory(path)) {
      throw UsageError(path.string() + ": expected a place for a file, found a folder; choose another -o");
    }
  }
  const auto folder = paths.tiff.parent_path();
  require_possible(folder.empty() ? "." : folder);
  if (options.overwrite) return;
  if (const auto recipe = read_recipe(paths.recipe)) {
    const std::string differs = difference(recipe->value("request", Json()), request);
    if (!differs.empty()) refuse(paths, differs);
    return;
  }
  std::erase(outputs, paths.report);
  for (const auto& path : outputs) {
    if (std::filesystem::exists(path)) refuse(paths, path.filename().string() + " without a recipe");
  }
}

std::string write_single_view(const Job& job, const Json& request, const Stopwatch& total, Console& console,
                              const Monitor& monitor) {
  const ImagePaths paths = image_paths(job.options);
  Json resolved = resolved_of(job);
  resolved["view"] = Json::parse(view_text(manifest_view(job, 0, paths.tiff.filename().string())));
  Json recipe = make_recipe(kProgram, request, resolved);
  std::string result = paths.tiff.string() + "\n" + paths.png.string() + "\n";
  for (const std::string& ending : layer_endings(job.options.layers)) {
    result += paths.layer(ending).string() + "\n";
  }
  result += paths.recipe.string() + "\n";
  if (paths.tiff.has_parent_path()) make_folder(paths.tiff.parent_path());
  const OutputLock lock(outputs_of(job.options, paths));

  if (!job.options.overwrite) {
    if (const auto found = read_recipe(paths.recipe)) {
      Json wanted = recipe;
      if (found->contains("display")) wanted["display"] = found->at("display");  // follows from the image
      const std::string differs = difference(*found, wanted);
      if (!differs.empty()) refuse(paths, differs);
      if (finished(paths, job.options)) {
        console.note("already done: the same recipe is there, nothing was rendered");
        return result;
      }
    }
  }

  const Products products = make_products(job, 0, monitor);
  for (const std::string& warning : products.warnings) console.warning(warning);
  monitor.check();

  const Stopwatch drawing;
  const float white = white_level(products.image);
  const DisplayScale scale(std::span(&white, 1));
  const std::vector<std::byte> picture = make_picture(products.image, job.options.quantity, scale);
  const std::vector<LayerFile> layers = layer_files(products, job.options, scale);
  recipe["display"] = scale.text(job.options.quantity);
  const double encode_s = products.encode_s + drawing.seconds();
  const Stopwatch writing;
  AtomicFiles files;
  files.add(paths.tiff, products.tiff);
  files.add(paths.png, picture);
  for (const LayerFile& layer : layers) files.add(paths.layer(layer.ending), layer.bytes);
  RunFigures figures;
  add(products, figures);
  figures.encode_s = encode_s;
  figures.write_s = writing.seconds();
  figures.total_s = total.seconds();
  files.add(paths.report, report_text(job, figures));
  files.add(paths.recipe, recipe_text(recipe));
  remove_old_layers(paths);
  // If the machine stops between the renames, no old recipe must stand beside new images.
  std::filesystem::remove(paths.recipe);
  files.commit();
  if (const std::string line = error_line(figures); !line.empty()) console.note(line);
  console.detail(summary(figures));
  return result;
}

}  // namespace sarnerf::app
