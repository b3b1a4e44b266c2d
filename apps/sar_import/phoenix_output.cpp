// SPDX-License-Identifier: Apache-2.0
#include "phoenix_output.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "checksums.h"
#include "folder_lock.h"
#include "output_files.h"
#include "recipe_file.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/chip.h"
#include "sarnerf/dataset/fingerprint.h"
#include "sarnerf/dataset/posed_image.h"
#include "sweep_place.h"

namespace sarnerf::app {
namespace {

std::string chip_name(std::size_t n) {
  char text[40];
  std::snprintf(text, sizeof text, "chip_%03zu.phoenix", n);
  return text;
}

std::vector<std::byte> chip_bytes(const Options& o, const Dataset& dataset, std::size_t n,
                                  const Monitor& monitor) {
  Image<float> amplitude =
      std::move(load_images(o.inputs.front(), dataset, {&n, 1}, monitor).front().power);
  take_amplitude(amplitude);
  DatasetView view = dataset.views[n];
  if (view.source.empty()) view.source = view.image;
  PhoenixChip chip = phoenix_of(view, amplitude);
  chip.resolution = dataset.resolution;
  return encode_phoenix(chip);
}

}  // namespace

std::string write_phoenix_chips(const Options& o, Console& console, const Monitor& monitor) {
  const Dataset dataset = read_manifest(o.inputs.front());
  const std::size_t n_views = dataset.views.size();
  if (o.explain) {
    const std::string plan = "plan\n  chips            " + std::to_string(n_views) + " of " +
                             o.inputs.front().string() + "\n  pixels           amplitude, " +
                             std::string(name(dataset.calibration)) +
                             ", phases 0\n  output           " + o.output.string() + "/\n";
    if (o.dry_run) return plan;
    console.asked_for(plan);
  }
  const std::filesystem::path recipe_path = o.output / "recipe.json";
  const Json recipe =
      make_recipe(kProgram,
                  {{"command", name(o.command)},
                   {"dataset_sha256", dataset_fingerprint(o.inputs.front(), dataset, monitor)}},
                  Json::object());
  refuse_input(o.output, o.inputs);
  require_possible(o.output);
  std::error_code ignored;
  const auto found = read_recipe(recipe_path);
  if (!o.overwrite && std::filesystem::exists(o.output / chip_name(0), ignored) && !found)
    refuse_place(o.output, "files without a recipe");
  if (!o.overwrite && std::filesystem::exists(o.output / kManifestName, ignored))
    refuse_place(o.output, "a dataset");
  if (found && !o.overwrite) {
    const std::string differs = difference(*found, recipe);
    if (!differs.empty()) refuse_place(o.output, differs);
  }
  make_folder(o.output);
  const FolderLock lock(o.output);
  write_file_atomically(recipe_path, recipe_text(recipe));

  Checksums checksums(o.output / "SHA256SUMS");
  std::size_t n_written = 0;
  for (std::size_t n = 0; n < n_views; ++n) {
    monitor.check();
    if (!checksums.whole(chip_name(n))) {
      const std::vector<std::byte> bytes = chip_bytes(o, dataset, n, monitor);
      AtomicFiles files(Durability::process);
      files.add(o.output / chip_name(n), bytes);
      files.commit();
      checksums.add({{chip_name(n), bytes}});
      ++n_written;
    }
    monitor.report("chips", n + 1, n_views);
  }
  checksums.finish();
  console.note(n_written == 0 ? "already done: all " + std::to_string(n_views) +
                                    " chips are there, nothing was written"
                              : "finished: " + std::to_string(n_views) + " chips");
  return o.output.string() + "/\n  " + std::to_string(n_views) + " Phoenix chips, " + chip_name(0) +
         " to " + chip_name(n_views - 1) + "\n";
}

}  // namespace sarnerf::app
