// SPDX-License-Identifier: Apache-2.0
#include "output_files.h"

#include <algorithm>
#include <cctype>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include "output_lock.h"
#include "recipe_file.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
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
  // A missing folder can be created if its nearest existing parent can be written to.
  std::filesystem::path existing = std::filesystem::absolute(folder);
  std::error_code code;
  while (!std::filesystem::exists(existing, code) && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  require_writable(existing);
}

void remove_files(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::path&)>& condition) {
  // Collected first: it is unspecified whether the iterator sees files that are removed meanwhile.
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

bool is_numbered(const std::filesystem::path& path, std::string_view prefix, std::string_view ending) {
  const std::string stem = path.stem().string();
  return path.extension() == ending && stem.size() > prefix.size() && stem.starts_with(prefix) &&
         std::all_of(stem.begin() + static_cast<std::ptrdiff_t>(prefix.size()), stem.end(),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

namespace {

constexpr std::string_view kStem = "view_";

bool is_view(const std::filesystem::path& path, std::string_view ending) { return is_numbered(path, kStem, ending); }

}  // namespace

SweepFolder::SweepFolder(std::filesystem::path folder, std::size_t n_views,
                         std::vector<std::string> layer_endings)
    : folder_(std::move(folder)),
      n_digits_(std::max(3, static_cast<int>(std::to_string(n_views - 1).size()))),
      layer_endings_(std::move(layer_endings)) {}

bool SweepFolder::is_layer(const std::filesystem::path& path) const {
  for (const std::string& ending : layer_endings_) {
    const std::string file = path.filename().string();
    if (file.ends_with(ending)) return is_view(file.substr(0, file.size() - ending.size()), "");
  }
  return false;
}

std::filesystem::path SweepFolder::manifest() const { return folder_ / kManifestName; }

std::string SweepFolder::stem(std::size_t view) const {
  const std::string digits = std::to_string(view);
  const auto n_zeros = static_cast<std::size_t>(n_digits_) - digits.size();
  return std::string(kStem) + std::string(n_zeros, '0') + digits;
}

std::string SweepFolder::image_name(std::size_t view) const { return "images/" + stem(view) + ".tif"; }

std::string SweepFolder::png_name(std::size_t view) const { return "png/" + stem(view) + ".png"; }

std::string SweepFolder::layer_name(std::size_t view, const std::string& ending) const {
  return "layers/" + stem(view) + ending;
}

void SweepFolder::create(bool with_layers) const {
  make_folder(images());
  make_folder(pngs());
  if (with_layers) make_folder(layers());
}

bool SweepFolder::described(std::size_t n_views) const {
  try {
    return std::filesystem::exists(report()) && read_manifest(folder_).views.size() == n_views;
  } catch (const InputError&) {
    return false;
  }
}

bool SweepFolder::occupied() const {
  const auto paths = {recipe(), manifest(), checksums(), images(), pngs(), layers()};
  return std::any_of(paths.begin(), paths.end(),
                     [](const auto& path) { return std::filesystem::exists(path); });
}

void SweepFolder::clear() const {
  std::filesystem::remove(manifest());
  std::filesystem::remove(report());
  std::filesystem::remove(checksums());
  remove_files(images(), [](const auto& path) { return is_view(path, ".tif"); });
  remove_files(pngs(), [](const auto& path) { return is_view(path, ".png"); });
  remove_files(layers(), [this](const auto& path) { return is_layer(path); });
  std::error_code not_empty;
  std::filesystem::remove(layers(), not_empty);
  std::filesystem::remove(recipe());
}

void SweepFolder::remove_temporary_files() const {
  for (const auto& folder : {folder_, images(), pngs(), layers()}) remove_files(folder, AtomicFiles::is_temporary);
}

void write_view_files(const SweepFolder& folder, const std::vector<Checksums::File>& view_files, Checksums& checksums) {
  AtomicFiles files(Durability::process);
  for (const auto& [name, bytes] : view_files) files.add(folder.path() / name, bytes);
  files.commit();
  checksums.add(view_files);
}

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
  // Whether a damaged recipe was this one can be decided only with the complete recipe: see holds_recipe().
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
  list.finish();  // drops a line that an interruption may have cut off: the next line would make it look complete
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
  // The process was killed between the recipe and its checksum.
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
