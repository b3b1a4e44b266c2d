// SPDX-License-Identifier: Apache-2.0
#include "sweep_place.h"

#include <nlohmann/json.hpp>

#include "checksums.h"
#include "output_files.h"
#include "sarnerf/core/atomic_file.h"
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
  // Whether a recipe that is damaged was this one is known when the rest of this one is.
  if (Checksums(folder.checksums()).damaged(folder.recipe().filename().string())) return;
  const auto recipe = read_recipe(folder.recipe());
  if (!recipe) refuse_place(folder.path(), "files without a recipe");
  const std::string differs = difference(recipe->value("request", Json()), request);
  if (!differs.empty()) refuse_place(folder.path(), differs);
}

void write_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums) {
  const std::string text = recipe_text(recipe);
  write_file_atomically(path, text);
  Checksums list(checksums);
  list.add({{path.filename().string(), std::as_bytes(std::span(text))}});
  list.finish();  // without the line that an interruption may have cut off, which another one would complete
}

bool holds_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums) {
  const std::string name = path.filename().string(), text = recipe_text(recipe);
  const Checksums list(checksums);
  if (list.damaged(name)) {
    if (!list.recorded(name, text))
      refuse_place(path.parent_path(), name + " is damaged, and was not that of this command");
    write_file_atomically(path, text);
    return true;
  }
  const auto found = read_recipe(path);
  if (!found) return false;
  const std::string differs = difference(*found, recipe);
  if (!differs.empty()) refuse_place(path.parent_path(), differs);
  // Killed between the recipe and its checksum.
  if (!list.recorded(name, text)) write_recipe(path, recipe, checksums);
  return true;
}

void take_sweep_place(const SweepFolder& folder, const Json& recipe, bool overwrite) {
  if (!overwrite && holds_recipe(folder.recipe(), recipe, folder.checksums())) return;
  if (!overwrite && folder.occupied()) refuse_place(folder.path(), "files without a recipe");
  folder.clear();
  write_recipe(folder.recipe(), recipe, folder.checksums());
}

}  // namespace sarnerf::app
