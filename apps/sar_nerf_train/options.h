// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "resolution_option.h"
#include "sarnerf/nerf/training_set.h"
#include "shared_options.h"
#include "view_choice.h"

namespace sarnerf::app {

/// Of the field `grid`: over what suits the images.
struct Smoothness {
  double factor = 1.0;
  bool validated = false;  ///< held-out views choose the factor
};

/// What the user asked for, checked one by one and against each other, before any file but --config is opened.
struct Options {
  std::filesystem::path dataset;
  std::string field = "grid";
  std::optional<bool> surfaces;  ///< unless the images decide
  SceneHeights heights;          ///< unless told, the images decide
  ResolutionChoice resolution;   ///< unless told, the dataset says
  Smoothness smoothness;
  std::int64_t steps = 0;        ///< 0: as many as suit the images
  std::optional<double> time_s;  ///< instead of steps: the schedule follows the clock
  std::string holdout_text = "auto";
  Holdout holdout;
  double patience = 0.0;          ///< share of the schedule; 0: training ends with it
  std::filesystem::path against;  ///< empty: no views of another dataset
  std::filesystem::path lpips;    ///< empty: not computed
  double despeckle_deg = 0.0;     ///< 0: single views are the only truth
  std::uint64_t seed = 1;
  std::vector<std::string> training;  ///< name=value
  std::filesystem::path run;          ///< folder of the output
  bool resume = false;                ///< `run` holds what is continued
  bool overwrite = false;
  bool explain = false;
  bool dry_run = false;               ///< print the plan and stop
  SharedOptions shared;
};

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file or a run that is not there.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace sarnerf::app
