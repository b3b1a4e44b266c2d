// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "recipe_file.h"

namespace sarnerf::app {

/// Common path, without ending, of an image's files: "-o a.tif" gives a.tif, a.png and a.json. An empty `output`
/// means `default_name`; in a folder, the files get that name. Throws UsageError for the folder of a dataset.
std::filesystem::path image_base(const std::string& output, const std::string& default_name);

/// The base with an ending appended; dots in its name are kept.
std::filesystem::path with_ending(const std::filesystem::path& base, const std::string& ending);

/// Throws Error unless the folder can be written to, or created. Creates nothing.
void require_possible(const std::filesystem::path& folder);

/// Removes the files of a folder that meet a condition, but none in its subfolders. A missing folder has no files.
void remove_files(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::path&)>& condition);

/// Throws UsageError if a file to be written is one of the inputs; skips empty paths.
void refuse_input(const std::filesystem::path& output,
                  std::span<const std::filesystem::path> inputs);

/// Whether the file's name is `prefix` and digits, with this ending: "view_012.tif".
bool is_numbered(const std::filesystem::path& path, std::string_view prefix, std::string_view ending);

/// Throws UsageError for an output inside an input folder: the next run would read its files as further input.
void refuse_inside(const std::filesystem::path& output, std::span<const std::filesystem::path> input_folders);

/// Names of the files in a sweep's folder.
class SweepFolder {
 public:
  /// `layer_endings`: endings of all files that layers/ may contain (".wall.tif").
  SweepFolder(std::filesystem::path folder, std::size_t n_views, std::vector<std::string> layer_endings = {});

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path recipe() const { return folder_ / "recipe.json"; }
  std::filesystem::path manifest() const;
  std::filesystem::path report() const { return folder_ / "dataset.report.json"; }
  std::filesystem::path images() const { return folder_ / "images"; }
  std::filesystem::path pngs() const { return folder_ / "png"; }

  /// Relative to the folder, as in the manifest: "images/view_007.tif".
  std::string image_name(std::size_t view) const;
  std::filesystem::path tiff(std::size_t view) const { return folder_ / image_name(view); }
  /// "png/view_007.png".
  std::string png_name(std::size_t view) const;
  std::filesystem::path layers() const { return folder_ / "layers"; }
  /// "layers/view_007.wall.tif" for ".wall.tif".
  std::string layer_name(std::size_t view, const std::string& ending) const;

  /// SHA-256 of the recipe and of all files of views, as sha256sum writes and checks them.
  std::filesystem::path checksums() const { return folder_ / "SHA256SUMS"; }

  void create(bool with_layers) const;

  /// Whether report and manifest are there, the manifest with so many views. One that is missing or damaged is made again.
  bool described(std::size_t n_views) const;

  /// Whether the folder contains any file or subfolder of a sweep.
  bool occupied() const;

  /// Deletes what an earlier sweep wrote, of any number of views, and nothing else. Deletes the recipe last: after an
  /// interruption, the remaining files can still be attributed to that sweep.
  void clear() const;

  /// Deletes temporary files of a killed process. Call it only while the folder is locked.
  void remove_temporary_files() const;

 private:
  std::string stem(std::size_t view) const;
  bool is_layer(const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  int n_digits_;
  std::vector<std::string> layer_endings_;
};

/// Writes the files of one view, named relative to the folder: all of them appear or none. Then adds them to the
/// checksums. Threads may call it. Throws Error.
void write_view_files(const SweepFolder& folder, const std::vector<Checksums::File>& view_files, Checksums& checksums);

/// Throws UsageError: other output occupies the folder, for the reason `why`.
[[noreturn]] void refuse_place(const std::filesystem::path& folder, const std::string& why);

/// Check before long work. Throws UsageError if the path is a file or contains output of another request, and Error
/// if the folder cannot be written.
void require_sweep_place(const SweepFolder& folder, const Json& request, bool overwrite);

/// Writes a recipe, and its checksum into the list. The checksum identifies the recipe if the file is damaged later.
void write_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums);

/// Whether the file holds this recipe. If the checksums show that it did, and it is now damaged or missing, writes it
/// again and returns true. Throws UsageError for another recipe, and for a damaged one that the checksums do not
/// identify as this one.
bool holds_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums);

/// Prepares the folder for this recipe. Without `overwrite`, keeps the output of the same recipe and refuses any
/// other; else clears the folder and writes the recipe. Call it only while the folder is locked. Throws UsageError as
/// holds_recipe().
void take_sweep_place(const SweepFolder& folder, const Json& recipe, bool overwrite);

}  // namespace sarnerf::app
