// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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
  std::filesystem::path score;          ///< mesh that is scored instead of an extraction; empty: none
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

/// Agreement of the extraction with the truth, and that of carving alone.
struct Scores {
  SurfaceScore extracted;
  TruthVolumeChoice truth_volume;
  std::optional<SurfaceScore> carved;
  double seconds = 0.0;
};

/// The true surface, and how its volume is determined.
struct Truth {
  TruthSurface surface;
  TruthVolumeChoice volume;
  std::vector<std::filesystem::path> files;  ///< the scene, and those that it names
};

/// Reads the truth. Reports on the console what was repaired, and how the volume is determined (truth_volume())
/// unless all of the truth is closed.
Truth load_truth(const Options& options, Console& console, const Monitor& monitor);

/// What a mesh is scored with: the views that saw the truth, and the images that carving uses.
struct Witnesses {
  std::vector<Acquisition> views;   ///< world coordinates
  std::vector<PosedImage> images;   ///< empty: the baseline is left out
};

/// Those of a model's training. Reports if its images are not available.
Witnesses witnesses_of(const Options& options, const ModelInfo& info, Console& console, const Monitor& monitor);

/// Scores a mesh and the carving baseline on a lattice. Warns if the truth has another size or position.
Scores score_mesh(const Truth& truth, const SurfaceMesh& mesh, const Witnesses& witnesses, const CarvingLattice& lattice,
                  std::optional<double> ground_height_m, Console& console, const Monitor& monitor);

/// Scores the mesh of --score; the views are those of a dataset folder or of a model. Writes the scores beside the mesh, as
/// MESH.score.json, and returns the table.
std::string score_and_write(const Options& options, Console& console, const Monitor& monitor);

/// The scores as a Markdown table; a line below it if the truth has no volume.
std::string table_text(const Scores& scores);

Json scores_json(const Scores& scores);

/// The text for stdout. It is also kept in the report, for a repeated command of the same recipe.
struct Printed {
  std::string paths;    ///< of the files, one a line
  std::string details;  ///< the grids of the volume, a line each, its metadata, and how the body was found
  std::string summary;  ///< the scores as a table, and one line: body, triangles, memory

  /// Paths alone when quiet; details when verbose or with --explain.
  std::string text(const Options& options) const;

  Json json() const;
  /// Nothing unless json() made it.
  static std::optional<Printed> from(const Json& json);
};

Printed printed_of(const Options& options, const Extraction& extraction, const std::optional<Scores>& scores);

/// The plan of --explain and --dry-run. Throws what plan_extraction() throws.
std::string plan_text(const Options& options, const Model& model);

/// Extracts, scores and writes; returns the text for stdout. If output of the same recipe exists, only reports it.
/// With --dry-run, returns the plan and writes nothing. Throws UsageError if other output is in the way, or another
/// program is writing the same files.
std::string extract_and_write(const Options& options, Console& console, const Monitor& monitor);

}  // namespace sarnerf::app
