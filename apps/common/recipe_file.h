// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf::app {

using Json = nlohmann::ordered_json;

/// The recipe: a complete description of how an image or a dataset was made. `request` holds the options as given,
/// `resolved` the values derived from them. Equal recipes give equal output, byte for byte. Threads, memory limits,
/// folders and times are not part of a recipe.
Json make_recipe(const std::string& program, const Json& request, const Json& resolved);

/// The recipe in a file, or nothing if the file is missing or is not a recipe.
std::optional<Json> read_recipe(const std::filesystem::path& path);

std::string recipe_text(const Json& recipe);

/// The first differences between two recipes (or parts of them), as "image.size: 64 there, 128 now"; empty if they are equal.
std::string difference(const Json& found, const Json& wanted);

/// The JSON with invalid UTF-8 replaced, as a file would return it: file names may contain any bytes.
Json valid_text(const Json& json);

/// List of the files that a sweep has written, with their SHA-256, in a file that `sha256sum --check` reads. A later
/// run uses it to determine which views are intact after a power failure, a full disk or a manual edit. Each line is
/// added when its file is in place.
class Checksums {
 public:
  /// Reads the existing list; skips invalid lines (the last one may be cut off).
  explicit Checksums(std::filesystem::path list);

  /// Whether the file, named relative to the list's folder, still has the bytes with which it was added.
  bool whole(const std::string& name) const;

  /// Whether the file was added with these bytes. Does not read its present content.
  bool recorded(const std::string& name, std::string_view bytes) const;
  /// Whether the file was added and now has other bytes or is missing.
  bool damaged(const std::string& name) const { return digest_.contains(name) && !whole(name); }

  /// Adds files that are in place, by name and bytes. Threads may call it. Throws Error if the list cannot be written.
  struct File {
    std::string name;
    std::span<const std::byte> bytes;
  };
  void add(const std::vector<File>& files);

  /// Rewrites the list with each file once, sorted by name, so that it does not depend on the order in which files were made.
  void finish();

 private:
  std::filesystem::path list_;
  std::map<std::string, std::string> digest_;  ///< by name
  std::mutex mutex_;
  std::ofstream out_;
};

/// Common white level of a sweep's display pictures, so that they can be compared and do not flicker as an animation: the
/// median of the white levels of a few views spread over the sweep. A wall that flashes in one view then does not darken the
/// others. The choice depends on the recipe alone, not on which views were finished before an interruption.
class DisplayScale {
 public:
  /// Indices of the views whose white levels determine the scale of a sweep: at most nine.
  static std::vector<std::size_t> sample_views(std::size_t n_views);

  /// From the white levels of those views (white_level()); skips blank views. If all are blank, each picture gets its
  /// own level.
  explicit DisplayScale(std::span<const float> white_levels);

  float white_for(const Image<float>& image) const;

  /// The levels (dB) of black and white, for recipes and manifests.
  Json text(Quantity quantity) const;

 private:
  std::optional<float> white_;
};

/// The display picture (PNG) of an image, for the eye.
std::vector<std::byte> make_picture(const Image<float>& image, Quantity quantity, const DisplayScale& scale);

}  // namespace sarnerf::app
