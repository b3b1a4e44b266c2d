// SPDX-License-Identifier: Apache-2.0
#include "sweep_folder.h"

#include <algorithm>
#include <cctype>
#include <system_error>
#include <vector>

#include "output_files.h"
#include "sarnerf/core/atomic_file.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf::app {
namespace {

constexpr std::string_view kStem = "view_";

/// "view_" and digits, with the ending.
bool is_view(const std::filesystem::path& path, std::string_view ending) {
  const std::string stem = path.stem().string();
  return path.extension() == ending && stem.size() > kStem.size() && stem.starts_with(kStem) &&
         std::all_of(stem.begin() + kStem.size(), stem.end(),
                     [](unsigned char c) { return std::isdigit(c) != 0; });
}

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

}  // namespace sarnerf::app
