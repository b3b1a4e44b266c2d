// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

namespace sarnerf::app {

/// One line of metrics.jsonl.
struct MetricsLine {
  std::int64_t step = 0;
  double seconds = 0.0;           ///< since the program's start
  std::optional<double> loss;     ///< mean since the line before
  std::optional<double> psnr_db;  ///< power, mean over the curve's views
};

/// How training went, line by line as it goes: {"step":10,"seconds":0.81,"loss":0.0012,"psnr_power_db":31.2}.
class MetricsLog {
 public:
  /// Keeps the lines up to `last_step` of what is there: those after it belong to steps that are done again.
  MetricsLog(std::filesystem::path path, std::int64_t last_step);

  /// Throws Error when the disk is full.
  void add(const MetricsLine& line);

  /// Those kept and those added.
  const std::vector<MetricsLine>& lines() const { return lines_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::vector<MetricsLine> lines_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace sarnerf::app
