// SPDX-License-Identifier: Apache-2.0
#include "output_place.h"

#include <system_error>

#include "output_files.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {
namespace {

std::string default_name(const Options& options) {
  return options.scene.stem().string() + "_sar";
}

std::filesystem::path base_of(const Options& options) {
  return image_base(options.output, default_name(options));
}

}  // namespace

ImagePaths image_paths(const Options& options) {
  const std::filesystem::path base = base_of(options);
  return {with_ending(base, ".tif"), with_ending(base, ".png"), with_ending(base, ".report.json"),
          with_ending(base, ".json")};
}

std::filesystem::path ImagePaths::layer(const std::string& ending) const {
  return with_ending(tiff.parent_path() / tiff.stem(), ending);
}

std::filesystem::path sweep_folder(const Options& options) {
  const std::filesystem::path folder = options.output.empty() ? default_name(options) : options.output;
  return folder.has_filename() ? folder : folder.parent_path();
}

std::string output_text(const Options& options) {
  if (options.sweep()) return sweep_folder(options).string() + "/";
  const std::string base = base_of(options).string();
  return base + ".tif, " + base + ".png, " + base + ".json";
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
  refuse_input(output, inputs);
}

}  // namespace sarnerf::app
