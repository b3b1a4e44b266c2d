// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sarnerf/dataset/calibration.h"
#include "sarnerf/geometry/acquisition.h"
#include "resolution_option.h"
#include "shared_options.h"

namespace sarnerf::app {

/// What the user asked for. Empty optionals and lists are taken from the model.
struct Options {
  std::filesystem::path model;  ///< the file, or the folder of a run

  std::vector<double> incidence_deg;
  std::vector<double> azimuth_deg{0.0};
  std::optional<double> altitude_m;
  std::optional<double> slant_range_m;
  std::optional<Look> look;
  std::optional<std::pair<int, int>> size;  ///< azimuth, range
  std::optional<std::pair<double, double>> spacing_m;
  std::optional<Quantity> quantity;
  ResolutionChoice resolution;  ///< unless told, the model's

  std::filesystem::path against;   ///< empty: new views are rendered
  std::filesystem::path training;  ///< empty: where the model says
  std::filesystem::path lpips;
  double despeckle_deg = 0.0;  ///< 0: single views are the only truth

  std::string output;
  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;  ///< print the plan and stop
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace sarnerf::app
