// SPDX-License-Identifier: Apache-2.0
#include "output_files.h"

#include <algorithm>
#include <system_error>
#include <vector>

#include "folder_name.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf::app {

std::filesystem::path image_base(const std::string& output, const std::string& default_name) {
  std::filesystem::path base = output.empty() ? default_name : output;
  std::error_code ignored;
  if (!base.has_filename() || std::filesystem::is_directory(base, ignored)) {
    if (std::filesystem::exists(base / kManifestName, ignored)) {
      throw UsageError(base.string() +
                       " is the dataset of a sweep, and this is a single view; choose "
                       "another name (-o)");
    }
    return base / default_name;
  }
  for (const char* ending : {".tif", ".tiff", ".png", ".json"}) {
    if (base.extension() == ending) return base.replace_extension();
  }
  return base;
}

std::filesystem::path with_ending(const std::filesystem::path& base, const std::string& ending) {
  return base.parent_path() / (base.filename().string() + ending);
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

void remove_files(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::path&)>& condition) {
  // Chosen first, since it is open whether reading a folder sees what is removed meanwhile.
  std::vector<std::filesystem::path> chosen;
  std::error_code missing;
  for (const auto& entry : std::filesystem::directory_iterator(folder, missing)) {
    if (entry.is_regular_file() && condition(entry.path())) chosen.push_back(entry.path());
  }
  for (const std::filesystem::path& path : chosen) std::filesystem::remove(path);
}

void refuse_input(const std::filesystem::path& output,
                  std::span<const std::filesystem::path> inputs) {
  for (const std::filesystem::path& input : inputs) {
    std::error_code ignored;
    if (!input.empty() && std::filesystem::equivalent(input, output, ignored)) {
      throw UsageError("the output " + output.string() +
                       " would replace the input; choose another -o");
    }
  }
}

void refuse_inside(const std::filesystem::path& output, std::span<const std::filesystem::path> input_folders) {
  const std::filesystem::path place = full_path(output);
  for (const std::filesystem::path& input : input_folders) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(input, ignored)) continue;
    const std::filesystem::path folder = full_path(input);
    if (std::mismatch(folder.begin(), folder.end(), place.begin(), place.end()).first != folder.end()) continue;
    throw UsageError("the output " + output.string() + " lies inside the input " + input.string() +
                     ", which would be read with it next time; choose another -o");
  }
}

}  // namespace sarnerf::app
