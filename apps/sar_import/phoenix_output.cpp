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
#include "sarnerf/core/format.h"
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

bool is_chip(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with("chip_") && path.extension() == ".phoenix";
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
  refuse_inside(o.output, o.inputs);
  require_possible(o.output);
  std::error_code ignored;
  if (std::filesystem::exists(o.output / kManifestName, ignored)) refuse_place(o.output, "a dataset");
  make_folder(o.output);
  const FolderLock lock(o.output);
  const std::filesystem::path list = o.output / "SHA256SUMS";
  if (o.overwrite || !holds_recipe(recipe_path, recipe, list)) {
    if (!o.overwrite && std::filesystem::exists(o.output / chip_name(0), ignored))
      refuse_place(o.output, "files without a recipe");
    // Chips of another recipe are whole, too, by the list.
    std::filesystem::remove(list);
    remove_files(o.output, is_chip);
    write_recipe(recipe_path, recipe, list);
  }

  Checksums checksums(list);
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
  console.note(n_written > 0   ? "finished: " + counted(n_views, "chip")
               : n_views == 1 ? "already done: the chip is there, nothing was written"
                              : "already done: all " + counted(n_views, "chip") + " are there, nothing was written");
  const std::string names = n_views == 1 ? chip_name(0) : chip_name(0) + " to " + chip_name(n_views - 1);
  return o.output.string() + "/\n  " + counted(n_views, "Phoenix chip") + ", " + names + "\n";
}

}  // namespace sarnerf::app
