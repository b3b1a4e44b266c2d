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

/// The whole recipe: how an image or a dataset was made, completely. `request` is what was asked for, `resolved` what
/// followed from it. Output whose recipe is the same is the same output, byte for byte. Threads, memory limits,
/// folders and times are no part of it.
Json make_recipe(const std::string& program, const Json& request, const Json& resolved);

/// The recipe in a file, or nothing when the file is missing or something else.
std::optional<Json> read_recipe(const std::filesystem::path& path);

std::string recipe_text(const Json& recipe);

/// Names the first places where two recipes (or parts of them) differ, as "image.size: 64 instead of
/// 128"; empty when they are equal.
std::string difference(const Json& found, const Json& wanted);

/// The same with what is not UTF-8 replaced, as it comes back from a file: names of files may be any bytes.
Json valid_text(const Json& json);

/// The files that a sweep has written, with their SHA-256, in a file that `sha256sum --check` reads. It is how a
/// later run knows which views are whole: machines lose power, disks fill up, people edit. Each line is added
/// when its file is in place.
class Checksums {
 public:
  /// Reads what is there; lines that say nothing (the last one may be cut off) are passed over.
  explicit Checksums(std::filesystem::path list);

  /// Whether the file, by its name relative to the list's folder, has the bytes that it had when it was added.
  bool whole(const std::string& name) const;

  /// Whether the file was added with these bytes, whatever has become of it since.
  bool recorded(const std::string& name, std::string_view bytes) const;
  /// Whether the file was added, and has other bytes now, or is gone.
  bool damaged(const std::string& name) const { return digest_.contains(name) && !whole(name); }

  /// Adds files that are in place: name and bytes. Threads may call it. Throws Error when the list cannot be
  /// written.
  struct File {
    std::string name;
    std::span<const std::byte> bytes;
  };
  void add(const std::vector<File>& files);

  /// Writes the list anew, each file once and in order, so that it does not tell what was made when.
  void finish();

 private:
  std::filesystem::path list_;
  std::map<std::string, std::string> digest_;  ///< by name
  std::mutex mutex_;
  std::ofstream out_;
};

/// The white level that display pictures share, so that a sweep's pictures can be compared and do not flicker
/// as an animation: the median of the white levels of a few views spread over the sweep. A wall that flashes
/// in one view then does not darken the others, and the choice depends on the recipe alone, not on which views
/// were finished before an interruption.
class DisplayScale {
 public:
  /// The views whose white levels the scale of a sweep is made of: at most nine.
  static std::vector<std::size_t> sample_views(std::size_t n_views);

  /// From the white levels of those views (white_level()); blank ones are passed over. When all are, each
  /// picture gets a level of its own.
  explicit DisplayScale(std::span<const float> white_levels);

  float white_for(const Image<float>& image) const;

  /// What black and white stand for, for recipes and manifests.
  Json text(Quantity quantity) const;

 private:
  std::optional<float> white_;
};

/// The display picture (PNG) of an image, for the eye.
std::vector<std::byte> make_picture(const Image<float>& image, Quantity quantity, const DisplayScale& scale);

}  // namespace sarnerf::app
