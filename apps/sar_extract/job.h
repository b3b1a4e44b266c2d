// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "console.h"
#include "process.h"
#include "recipe_file.h"
#include "sarnerf/bake/extract.h"
#include "sarnerf/bake/score.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/scene/scene.h"

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

/// How well the extraction agrees with the truth, and how well mere carving would.
struct Scores {
  SurfaceScore extracted;
  TruthVolumeChoice truth_volume;
  std::optional<SurfaceScore> carved;
  double seconds = 0.0;
};

/// The truth as the program takes it.
struct Truth {
  TruthSurface surface;
  TruthVolumeChoice volume;
};

/// Reads it, and tells the console what was mended, and what its volume is (truth_volume()) unless all of it is closed.
Truth load_truth(const Options& options, Console& console, const Monitor& monitor);

/// Warns of a truth of another size or elsewhere, and where the baseline has to be left out.
Scores score_extraction(const Options& options, const Truth& truth, const Model& model, const Extraction& extraction,
                        Console& console, const Monitor& monitor);

/// Markdown, for people; under it a line where the truth has no volume.
std::string table_text(const Scores& scores);

Json scores_json(const Scores& scores);

/// What goes to stdout at the end, and is kept for when the same is asked for again.
struct Printed {
  std::string paths;    ///< of the files, one a line
  std::string details;  ///< the grids of the volume, a line each, its metadata, and how the body was found
  std::string summary;  ///< the scores as a table, and one line: body, triangles, memory

  /// Paths alone when quiet; details when verbose or where --explain asks for them.
  std::string text(const Options& options) const;

  Json json() const;
  /// Nothing unless json() made it.
  static std::optional<Printed> from(const Json& json);
};

Printed printed_of(const Options& options, const Extraction& extraction, const std::optional<Scores>& scores);

/// The plan of --explain and --dry-run. Throws what plan_extraction() throws.
std::string plan_text(const Options& options, const Model& model);

/// Extracts, scores and writes; returns what is printed on stdout. Output of the same recipe that is there already is
/// only told of. With --dry-run returns the plan and writes nothing. Throws UsageError where other output is in the way, or
/// another program is writing the same.
std::string extract_and_write(const Options& options, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
