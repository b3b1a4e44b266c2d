// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace sarnerf::app {

/// Where the program's time went: wall-clock seconds by stage, in order.
struct StageTimes {
  std::vector<std::pair<std::string, double>> stages;
  void add(std::string name, double seconds) { stages.emplace_back(std::move(name), seconds); }
};

}  // namespace sarnerf::app
