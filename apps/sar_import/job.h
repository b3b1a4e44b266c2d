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

/// The subcommand: the kind of input, or for `phoenix` the kind of output.
enum class Command { mstar, sample, images, phoenix };

/// Axes of the pixels of picture files.
enum class Orientation {
  chip,   ///< as in MSTAR: rows from far to near range, the radar below
  radar,  ///< as in this project: rows are azimuth, columns range, near to far
};

/// Selects images, and the part of each that is kept.
struct Selection {
  std::string class_name;                   ///< empty: any
  std::vector<double> depression_deg;       ///< nominal; empty: any
  std::optional<double> every_deg;          ///< step of a regular azimuth grid, whose nearest images are taken; none: all
  std::optional<std::pair<int, int>> crop;  ///< azimuth × range pixels
};

/// What the user asked for.
struct Options {
  Command command = Command::mstar;
  std::vector<std::filesystem::path>
      inputs;  ///< files and folders; one folder for `images` and `phoenix`
  std::filesystem::path output;
  Selection selection;

  double slant_range_m = 4500.0;  ///< used if the file gives none

  // Options of `images` only.
  std::filesystem::path table;  ///< CSV; empty: file names begin with the azimuth
  std::optional<std::pair<double, double>>
      spacing_m;       ///< azimuth, range; used if the table gives none
  double scale = 1.0;  ///< physical value of one pixel code
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
      chip;  ///< without its pixels; pictures have no size yet, and depression 0 if it is not known
  std::string split;  ///< from the table; empty: none
};

/// All images of the inputs, in no particular order. Reads Phoenix and SAMPLE files to the end, so that bad files are found
/// before any work; for pictures, reads the table or the names. Skips files of other kinds in folders, with a note. Throws
/// InputError for bad files and if nothing is found, UsageError if the pixel spacing of a picture is not known.
std::vector<Source> find_sources(const Options& options, Console& console, const Monitor& monitor);

/// Throws UsageError if decoding the largest file on every thread needs more memory than is allowed. Reads headers.
void refuse_beyond_memory(const Options& options, const std::vector<Source>& sources);

/// Reads every image once and records its size, so that bad files are found before anything is written. Throws InputError.
void read_sizes(const Options& options, std::vector<Source>& sources, const Monitor& monitor);

/// The source with its pixels, cropped. Throws InputError for a file that has become bad.
Chip load(const Options& options, const Source& source);

/// The resolution of the chips' impulse responses if all files give the same one; else nothing.
std::optional<Resolution> common_resolution(std::span<const Source> sources);

/// The sources to be imported.
struct Choice {
  std::vector<Source> chosen;         ///< sorted by class, serial, depression, azimuth
  std::vector<std::string> left_out;  ///< how many and why, a line each
};

/// Applies --class, --depression and --every, and fills in class and depression if the sources have none. With
/// --every, each class, serial and nominal depression has its own grid; each grid azimuth takes the nearest image
/// within half a step that no other has taken. Throws UsageError if nothing is left or a depression is not known.
Choice choose(std::vector<Source> sources, const Selection& selection);

/// Same class, serial and nominal depression.
bool same_set(const Source& a, const Source& b);

/// Angle from a to b (deg) the short way round: 0 to 180.
double apart_deg(double a_deg, double b_deg);

/// A warning if neighbouring images of a set have the same azimuth; else empty.
std::string duplicates_text(const std::vector<Source>& chosen);

/// Writes the chosen images into a dataset folder in the format of sar_render (docs/guide/outputs.md): float32 TIFF,
/// pictures, manifest, recipe, checksums, report. Continues an earlier run of the same recipe; the bytes do not
/// depend on threads and interruptions. Returns the manifest's path and a summary. Throws UsageError if other output
/// is in the way, Interrupted after writing a manifest of the finished views.
std::string write_dataset(const Options& options, const Choice& choice, Console& console,
                          const Monitor& monitor);

/// Writes each view of a dataset as chip_000.phoenix, …, with recipe.json and SHA256SUMS beside. Keeps files that
/// exist and are intact. Returns the text for stdout. Throws UsageError if other output is in the way.
std::string write_phoenix_chips(const Options& options, Console& console, const Monitor& monitor);

/// The recipe of a dataset: the options, and the chosen files with their SHA-256. Reads all of these files.
Json recipe_of(const Options& options, const std::vector<Source>& chosen, const Monitor& monitor);

/// The report of the run as JSON: images, time, memory, machine.
std::string report_text(const Options& options, const Choice& choice, std::size_t n_written);

/// Summary of the chosen images: sets, azimuths and their widest gaps, spacings, assumptions. Each line begins with
/// two spaces.
std::string summary_text(const Choice& choice);

/// The plan: source, choice, what is left out and why, reading convention, output.
std::string plan_text(const Options& options, const Choice& choice);

}  // namespace sarnerf::app
