// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "sarnerf/bake/extract.h"
#include "sarnerf/scene/scene.h"
#include "shared_options.h"

namespace sarnerf::app {

/// What the user asked for.
struct Options {
  std::filesystem::path model;   ///< the file, or the folder of a run
  std::filesystem::path output;  ///< .vdb
  ExtractOptions extract;        ///< without memory, checksum and monitor

  std::filesystem::path mesh, preview;  ///< empty: not written
  std::filesystem::path truth;          ///< empty: no score
  LoadOptions truth_options;
  std::string images = "auto";          ///< folder of the carving baseline's images, auto or none

  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace sarnerf::app
