// SPDX-License-Identifier: Apache-2.0
#include "sweep_place.h"

#include <nlohmann/json.hpp>

#include "output_files.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {

void refuse_place(const std::filesystem::path& folder, const std::string& why) {
  throw UsageError(folder.string() + ": other output is in the way (" + why +
                   "); choose another folder (-o) or allow --overwrite");
}

void require_sweep_place(const SweepFolder& folder, const Json& request, bool overwrite) {
  std::error_code code;
  if (std::filesystem::exists(folder.path(), code) &&
      !std::filesystem::is_directory(folder.path(), code))
    throw UsageError(folder.path().string() +
                     ": expected a place for a folder, found a file; choose another -o");
  require_possible(folder.path());
  if (overwrite || !folder.occupied()) return;
  const auto recipe = read_recipe(folder.recipe());
  if (!recipe) refuse_place(folder.path(), "files without a recipe");
  const std::string differs = difference(recipe->value("request", Json()), request);
  if (!differs.empty()) refuse_place(folder.path(), differs);
}

}  // namespace sarnerf::app
