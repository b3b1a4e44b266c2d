// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <mutex>
#include <string>

#include "console.h"
#include "sarnerf/dataset/manifest.h"

namespace sarnerf::app {

/// Warnings of many views, each kind once, in the words of its first view. Threads may add.
class WarningList {
 public:
  void add(const DatasetView& view, std::size_t index, const std::string& text);
  void print(Console& console) const;

 private:
  struct Entry {
    std::size_t n_views = 0;
    std::size_t first = 0;
    std::string text;
    double incidence_deg = 0.0, azimuth_deg = 0.0;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> entries_;  ///< by the text without its figures
};

}  // namespace sarnerf::app
