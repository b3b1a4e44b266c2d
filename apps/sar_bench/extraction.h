// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "console.h"
#include "sarnerf/report/plot.h"

namespace sarnerf::bench {

/// Options of the measured loop: render images of a mesh, learn a field from them, extract the body from the field,
/// compare it with the mesh. Each step runs the program itself, as users run it.
struct ExtractionOptions {
  std::vector<std::string> scene_files;
  double scale = 1.0;                 ///< of the scenes' coordinates
  std::string ground_height = "auto"; ///< m, for sar_extract
  std::vector<std::string> fields{"surface"};
  std::vector<std::filesystem::path> beside;  ///< extraction.json of other studies, drawn in the same diagrams
  /// Numbers of azimuths, evenly around, at 45°; with "xN" at each of N pitches from 35° to 55°.
  std::vector<std::string> views{"12", "24", "36", "72", "36x11"};
  std::vector<std::string> times{"2s", "5s", "10s", "20s", "60s"};
  int n_seeds = 1;
  std::filesystem::path output;  ///< folder
  bool overwrite = false, quiet = false, dry_run = false;
};

/// Directions from which a scene is seen.
struct ViewSet {
  int n_azimuth = 36, n_pitch = 1;

  int count() const { return n_azimuth * n_pitch; }
  std::string text() const;  ///< "36" or "36x11"
};

/// Reads such a text. Throws UsageError.
ViewSet parse_view_set(const std::string& text);

/// One training, and the extraction from its field.
struct ExtractionRun {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::string scene;
  std::string method;                    ///< field, or what a recorded study calls it
  ViewSet views;
  double planned_s = 0.0;
  std::uint64_t seed = 1;
  std::string failed;                    ///< why nothing was measured; else empty
  double training_s = kUnknown;          ///< of the whole program, its start included
  double extraction_s = kUnknown;        ///< of the whole program, without the scoring
  double iou = kUnknown;
  double difference_m = kUnknown;        ///< symmetric difference over the true area
  double chamfer_m = kUnknown;           ///< over the surface that at least one training view sees
  double hausdorff_m = kUnknown;         ///< the same
  double carving_iou = kUnknown;         ///< of carving alone, on the voxels of the extraction
  double carving_difference_m = kUnknown;
  double carving_chamfer_m = kUnknown;   ///< the same, over the visible surface
};

/// Renders, learns and extracts for every combination of scene, view set, field, time and seed; each has its own training. Data,
/// models and volumes stay in the output folder. Calls `finished` after each run with all runs so far. Reports a failed run on
/// the console and keeps it as failed. Throws UsageError, Error if a scene cannot be rendered, Interrupted.
void study_extraction(const ExtractionOptions& options, app::Console& console,
                      const std::function<void(const std::vector<ExtractionRun>&)>& finished);

/// Runs the study. Writes extraction.json, extraction.md and the diagrams into the output folder anew after each run,
/// and prints the table at the end. Throws UsageError if another study is in the way.
void run_extraction_command(const ExtractionOptions& options, app::Console& console);

/// Runs that differ only in their seed.
struct ExtractionGroup {
  std::string scene, method;
  ViewSet views;
  double planned_s = 0.0;
  std::vector<const ExtractionRun*> ended;  ///< the runs that did not fail
};

/// In the order of their first run.
std::vector<ExtractionGroup> groups_of(const std::vector<ExtractionRun>& runs);

/// A quantity of a run, as &ExtractionRun::iou.
using ExtractionQuantity = double ExtractionRun::*;

/// Mean and range over the seeds; not a number if nothing was measured.
struct Spread {
  double mean = ExtractionRun::kUnknown, least = ExtractionRun::kUnknown, most = ExtractionRun::kUnknown;
};
Spread spread_of(const ExtractionGroup& group, ExtractionQuantity quantity);

/// Diagrams and the names of their files: for each scene symmetric difference and visible-surface Chamfer distance, against seconds of
/// training (a line for each method and set of views) and against the number of views (a line for each method and planned
/// time, and carving). Means over seeds, bars from the least to the largest. Failed runs are left out.
std::vector<std::pair<std::string, Plot>> extraction_diagrams(const std::vector<ExtractionRun>& runs);

/// A row for each scene, method, set of views and time, means over seeds, in Markdown.
std::string extraction_table(const std::vector<ExtractionRun>& runs);

/// The runs as JSON, and back. Throws InputError for a file that is no study.
nlohmann::json extraction_json(const std::vector<ExtractionRun>& runs);
std::vector<ExtractionRun> read_extraction_runs(const std::filesystem::path& file);

}  // namespace sarnerf::bench
