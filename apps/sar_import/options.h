// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sarnerf/dataset/calibration.h"
#include "shared_options.h"

namespace sarnerf::app {

/// What is read; or written, by the last one.
enum class Command { mstar, sample, images, phoenix };

/// How the pixels of picture files lie.
enum class Orientation {
  chip,   ///< as MSTAR's: rows from far to near range, the radar below
  radar,  ///< as our own: rows are azimuth, columns range, near to far
};

/// Which images of many are taken, and what of each.
struct Selection {
  std::string class_name;                   ///< empty: any
  std::vector<double> depression_deg;       ///< nominal; empty: any
  std::optional<double> every_deg;          ///< nearest to a regular grid of azimuths; none: all
  std::optional<std::pair<int, int>> crop;  ///< azimuth × range pixels
};

/// What the user asked for.
struct Options {
  Command command = Command::mstar;
  std::vector<std::filesystem::path>
      inputs;  ///< files and folders; one folder for `images` and `phoenix`
  std::filesystem::path output;
  Selection selection;

  double slant_range_m = 4500.0;  ///< where no file says one

  // Of `images` only.
  std::filesystem::path table;  ///< CSV; empty: names carry the azimuths
  std::optional<std::pair<double, double>>
      spacing_m;       ///< azimuth, range; where the table says none
  double scale = 1.0;  ///< physical value of one code
  Quantity quantity = Quantity::amplitude;
  Orientation orientation = Orientation::chip;

  bool overwrite = false, explain = false, dry_run = false;
  SharedOptions shared;
};

/// Name of this program in recipes.
inline constexpr const char* kProgram = "sar_import";

std::string_view name(Command command);
std::string_view name(Orientation orientation);

/// Empty when help or the version was asked for and has been printed. Throws UsageError, and InputError for a bad
/// configuration file.
std::optional<Options> parse_options(int argc, char** argv);

}  // namespace sarnerf::app
