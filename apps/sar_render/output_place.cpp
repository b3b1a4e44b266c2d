// SPDX-License-Identifier: Apache-2.0
#include "output_place.h"

#include <system_error>

#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf::app {
namespace {

std::string default_name(const Options& options) {
  return options.scene.stem().string() + "_sar";
}

/// The output's path without an ending: "-o a.tif" means a.tif, a.png and a.json.
std::filesystem::path image_base(const Options& options) {
  std::filesystem::path base = options.output.empty() ? default_name(options) : options.output;
  std::error_code ignored;
  if (!base.has_filename() || std::filesystem::is_directory(base, ignored)) {
    if (std::filesystem::exists(base / kManifestName, ignored)) {
      throw UsageError(base.string() + " is the dataset of a sweep, and this is a single view; choose "
                                       "another name (-o)");
    }
    return base / default_name(options);
  }
  for (const char* ending : {".tif", ".tiff", ".png", ".json"}) {
    if (base.extension() == ending) return base.replace_extension();
  }
  return base;
}

std::filesystem::path with_ending(const std::filesystem::path& base, const char* ending) {
  return base.parent_path() / (base.filename().string() + ending);
}

}  // namespace

ImagePaths image_paths(const Options& options) {
  const std::filesystem::path base = image_base(options);
  return {with_ending(base, ".tif"), with_ending(base, ".png"), with_ending(base, ".report.json"),
          with_ending(base, ".json")};
}

std::filesystem::path ImagePaths::layer(const std::string& ending) const {
  return with_ending(tiff.parent_path() / tiff.stem(), ending.c_str());
}

std::filesystem::path sweep_folder(const Options& options) {
  const std::filesystem::path folder = options.output.empty() ? default_name(options) : options.output;
  return folder.has_filename() ? folder : folder.parent_path();
}

std::string output_text(const Options& options) {
  if (options.sweep()) return sweep_folder(options).string() + "/";
  const std::string base = image_base(options).string();
  return base + ".tif, " + base + ".png, " + base + ".json";
}

void require_possible(const std::filesystem::path& folder) {
  // What is missing can be created if its nearest existing parent can be written to.
  std::filesystem::path existing = std::filesystem::absolute(folder);
  std::error_code code;
  while (!std::filesystem::exists(existing, code) && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  require_writable(existing);
}

void require_volume_place(const Options& options) {
  const std::filesystem::path& place = options.save_volume;
  if (place.empty()) return;
  refuse_input(place, options);
  std::error_code ignored;
  if (!options.overwrite && std::filesystem::exists(place, ignored)) {
    throw UsageError("--save-volume: " + place.string() +
                     " exists; choose another name or allow --overwrite");
  }
  require_possible(place.has_parent_path() ? place.parent_path() : std::filesystem::path("."));
}

void refuse_input(const std::filesystem::path& output, const Options& options) {
  std::vector<std::filesystem::path> inputs{options.scene, options.materials, options.shared.config_file};
  inputs.insert(inputs.end(), options.indirect_inputs.begin(), options.indirect_inputs.end());
  for (const std::filesystem::path& input : inputs) {
    std::error_code ignored;
    if (!input.empty() && std::filesystem::equivalent(input, output, ignored)) {
      throw UsageError("the output " + output.string() + " would replace the input; choose another -o");
    }
  }
}

}  // namespace sarnerf::app
