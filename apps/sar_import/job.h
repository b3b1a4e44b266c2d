// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "console.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/phoenix.h"
#include "sarnerf/dataset/posed_image.h"

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

/// An image that could be imported.
struct Source {
  std::filesystem::path file;
  Chip
      chip;  ///< without its pixels; pictures have no size yet, nor a depression (0) where none is known
  std::string split;  ///< of a table; empty: none
};

/// All that the inputs hold, in no order. Phoenix and SAMPLE files are read to the end, so that a bad one costs no work;
/// of pictures the table or the names. Files of other kinds in folders are passed over with a note. Throws InputError
/// for bad ones and where nothing is found.
std::vector<Source> find_sources(const Options& options, Console& console, const Monitor& monitor);

/// Throws UsageError where the largest of the files, decoded on every thread, takes more than there is. Reads headers.
void refuse_beyond_memory(const Options& options, const std::vector<Source>& sources);

/// Reads every image once and notes its size, so that a bad one is known before anything is written. Throws InputError.
void read_sizes(const Options& options, std::vector<Source>& sources, const Monitor& monitor);

/// The source with its pixels, cropped. Throws InputError for a file that is bad by now.
Chip load(const Options& options, const Source& source);

/// The resolution of all chips' impulse responses, where their files say the same.
std::optional<Resolution> common_resolution(std::span<const Source> sources);

/// Of many sources those to be imported.
struct Choice {
  std::vector<Source> chosen;         ///< by class, serial, depression, azimuth
  std::vector<std::string> left_out;  ///< how many and why, a line each
};

/// Applies --class, --depression and --every, and fills in class and depression where the sources have none. With
/// --every each class, serial and nominal depression has a grid of its own; a grid azimuth gets the nearest image within
/// half a step that no other has got. Throws UsageError where nothing is left or a depression is not known.
Choice choose(std::vector<Source> sources, const Selection& selection);

/// Same class, serial and nominal depression.
bool same_set(const Source& a, const Source& b);

/// Angle from a to b (deg) the short way round: 0 to 180.
double apart_deg(double a_deg, double b_deg);

/// A warning where neighbours of a set were taken from the same azimuth; else empty.
std::string duplicates_text(const std::vector<Source>& chosen);

/// Writes the chosen images into a dataset folder of sar_render's form (docs/guide/outputs.md): float32 TIFF, pictures,
/// manifest, recipe, checksums, report. Goes on where an earlier run of the same recipe stopped; the same bytes whatever
/// the threads and interruptions. Returns the manifest's path and a summary. Throws UsageError when other output is in
/// the way, Interrupted after writing a manifest of the finished views.
std::string write_dataset(const Options& options, const Choice& choice, Console& console,
                          const Monitor& monitor);

/// Writes each view of a dataset as chip_000.phoenix, …, with recipe.json and SHA256SUMS beside; files that are there
/// and whole are kept. Returns what is printed on stdout. Throws UsageError when other output is in the way.
std::string write_phoenix_chips(const Options& options, Console& console, const Monitor& monitor);

/// The recipe of a dataset: what was asked for, and the chosen files with their SHA-256. Reads all of them.
Json recipe_of(const Options& options, const std::vector<Source>& chosen, const Monitor& monitor);

/// What the run took, as JSON.
std::string report_text(const Options& options, const Choice& choice, std::size_t n_written);

/// What the chosen images are, for people: sets, azimuths and their widest gaps, spacings, what is assumed. One line
/// each, beginning with two spaces.
std::string summary_text(const Choice& choice);

/// The plan: source, choice, what is left out and why, reading convention, output.
std::string plan_text(const Options& options, const Choice& choice);

}  // namespace sarnerf::app
