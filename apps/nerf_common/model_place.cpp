// SPDX-License-Identifier: Apache-2.0
#include "model_place.h"

#include <system_error>

#include "folder_name.h"

namespace sarnerf::app {
namespace {

constexpr const char* kModel = "model.pt";

}  // namespace

std::filesystem::path model_file(const std::filesystem::path& model) {
  std::error_code ignored;
  return std::filesystem::is_directory(model, ignored) ? model / kModel : model;
}

std::string model_name(const std::filesystem::path& model) {
  const std::filesystem::path full = full_path(model);
  return (full.filename() == kModel ? full.parent_path().filename() : full.stem()).string();
}

}  // namespace sarnerf::app
