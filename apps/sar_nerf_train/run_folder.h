// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace sarnerf::app {

/// Names of the files in a run's folder.
class RunFolder {
 public:
  explicit RunFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path model() const { return folder_ / "model.pt"; }
  std::filesystem::path checkpoints() const { return folder_ / "checkpoints"; }
  std::filesystem::path checkpoint() const { return checkpoints() / "latest.pt"; }
  std::filesystem::path config() const { return folder_ / "config.toml"; }
  std::filesystem::path metrics() const { return folder_ / "metrics.jsonl"; }
  std::filesystem::path report() const {
    return folder_ / "report.json";
  }  ///< written last: the run is complete
  std::filesystem::path page() const { return folder_ / "report.html"; }
  std::filesystem::path pictures() const { return folder_ / "val"; }

  /// Whether anything of a run is there.
  bool occupied() const;

  /// Deletes what an earlier run wrote and nothing else; config.toml goes last: whatever stops this in the middle, the
  /// rest is still known as that run's.
  void clear() const;

  /// Deletes reports and pictures: what is about to be made anew.
  void clear_reports() const;

  /// Creates the folders, and deletes temporary files of a killed process. Only while the folder is locked.
  void prepare() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace sarnerf::app
