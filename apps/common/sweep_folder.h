// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace sarnerf::app {

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

}  // namespace sarnerf::app
