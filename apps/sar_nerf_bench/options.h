// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "shared_options.h"

namespace sarnerf::bench {

/// Each contestant with the times that its runs are planned for (s), ascending.
using Contest = std::vector<std::pair<std::string, std::vector<double>>>;

struct Options {
  std::filesystem::path training, against;
  Contest contest;
  int n_seeds = 1;
  std::size_t n_views = 16;
  std::filesystem::path output;
  bool overwrite = false;
  bool dry_run = false;  ///< print the runs and stop
  app::SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace sarnerf::bench
