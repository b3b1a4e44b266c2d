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

Model open_model(const std::filesystem::path& model, Console& console) {
  const std::filesystem::path file = model_file(model);
  Model read = read_model(file);
  if (!read.ignored.empty())
    console.warning(file.string() + ": was written by an older version and holds " + read.ignored +
                    ", which are ignored: views are what the field renders");
  return read;
}

}  // namespace sarnerf::app
