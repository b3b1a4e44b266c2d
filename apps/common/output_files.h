// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "recipe_file.h"

namespace sarnerf::app {

/// The path without an ending of an image's files: "-o a.tif" means a.tif, a.png and a.json; an empty `output` means
/// `default_name`, and a folder gets files of that name. Throws UsageError for the folder of a dataset.
std::filesystem::path image_base(const std::string& output, const std::string& default_name);

/// The base with an ending, whatever dots are in its name.
std::filesystem::path with_ending(const std::filesystem::path& base, const std::string& ending);

/// Throws Error unless the folder can be written to, or created. Creates nothing.
void require_possible(const std::filesystem::path& folder);

/// Removes the files of a folder, and none of folders in it, that meet a condition; a folder that is missing has none.
void remove_files(const std::filesystem::path& folder, const std::function<bool(const std::filesystem::path&)>& condition);

/// Throws UsageError when a file to be written is one of the inputs; empty ones are passed over.
void refuse_input(const std::filesystem::path& output,
                  std::span<const std::filesystem::path> inputs);

/// Throws UsageError for an output inside a folder that is read: the next reader would take its files for more of the same.
void refuse_inside(const std::filesystem::path& output, std::span<const std::filesystem::path> input_folders);

/// Names of the files in a sweep's folder.
class SweepFolder {
 public:
  /// `layer_endings`: of all files that may lie in layers/ (".wall.tif").
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

  /// SHA-256 of all files of views, as sha256sum writes and checks them.
  std::filesystem::path checksums() const { return folder_ / "SHA256SUMS"; }

  void create(bool with_layers) const;

  /// Whether anything of a sweep is there.
  bool occupied() const;

  /// Deletes what an earlier sweep wrote, of any number of views, and nothing else. The recipe goes
  /// last: whatever stops this in the middle, the rest is still known as that sweep's.
  void clear() const;

  /// Deletes temporary files of a killed process. Only while the folder is locked.
  void remove_temporary_files() const;

 private:
  std::string stem(std::size_t view) const;
  bool is_layer(const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  int n_digits_;
  std::vector<std::string> layer_endings_;
};

/// Writes the files of one view, by their names relative to the folder: all of them appear or none. Then adds them to the
/// checksums. Threads may call it. Throws Error.
void write_view_files(const SweepFolder& folder, const std::vector<Checksums::File>& view_files, Checksums& checksums);

/// Throws UsageError: other output is in the way, for this reason.
[[noreturn]] void refuse_place(const std::filesystem::path& folder, const std::string& why);

/// Before long work: throws UsageError where a file, or output of another request, is in the folder's place, and Error
/// where none can be written.
void require_sweep_place(const SweepFolder& folder, const Json& request, bool overwrite);

/// Writes a recipe, and its checksum into the list: with that, a recipe that is damaged later is
/// known to be this one.
void write_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums);

/// Whether the file holds this recipe; or did, by the list of checksums, and is now damaged or gone: then it is written
/// again. Throws UsageError for another recipe, and for one that is damaged and not known.
bool holds_recipe(const std::filesystem::path& path, const Json& recipe, const std::filesystem::path& checksums);

/// Makes the folder that of this recipe: keeps what is there of the same one, empties it where `overwrite` or nothing is
/// there. Only while the folder is locked. Throws UsageError as holds_recipe().
void take_sweep_place(const SweepFolder& folder, const Json& recipe, bool overwrite);

}  // namespace sarnerf::app
