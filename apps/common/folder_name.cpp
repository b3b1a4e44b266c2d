// SPDX-License-Identifier: Apache-2.0
#include "folder_name.h"

#include <system_error>

namespace sarnerf::app {

std::filesystem::path without_slash(const std::filesystem::path& folder) {
  return folder.has_filename() ? folder : folder.parent_path();
}

std::filesystem::path dataset_folder(const std::filesystem::path& dataset) {
  if (dataset.filename() != "dataset.json") return without_slash(dataset);
  return dataset.has_parent_path() ? dataset.parent_path() : std::filesystem::path(".");
}

std::filesystem::path full_path(const std::filesystem::path& path) {
  std::error_code ignored;
  return without_slash(std::filesystem::weakly_canonical(path, ignored));
}

}  // namespace sarnerf::app
