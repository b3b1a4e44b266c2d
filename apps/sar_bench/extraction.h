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

/// The loop that is measured: images of a mesh, a field learned from them, the body taken out of that, compared with the
/// mesh. Each step is the program of that name, as people run it.
struct ExtractionOptions {
  std::vector<std::string> scene_files;
  double scale = 1.0;                 ///< of the scenes' coordinates
  std::string ground_height = "auto"; ///< m, for sar_extract
  std::string field = "grid";
  std::string surfaces = "auto";      ///< of sar_nerf_train
  /// Azimuths, evenly around, at 45°; with "xN" at N pitches from 35° to 55°.
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

/// Of such a text. Throws UsageError.
ViewSet parse_view_set(const std::string& text);

/// One field, learned once.
struct ExtractionRun {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::string scene;
  ViewSet views;
  double planned_s = 0.0;
  std::uint64_t seed = 1;
  std::string failed;                    ///< why nothing was measured; else empty
  double training_s = kUnknown;          ///< of the whole program, its start included
  double extraction_s = kUnknown;        ///< the same, less the scoring
  double iou = kUnknown;
  double chamfer_m = kUnknown;           ///< over the surface that some training view sees
  double hausdorff_m = kUnknown;         ///< the same
  double carving_iou = kUnknown;         ///< of carving alone, on the voxels that were extracted
  double carving_chamfer_m = kUnknown;   ///< the same, over the visible surface
};

/// Renders, learns and extracts: every scene by view sets by times by seeds, each training a run of its own. Data, models and
/// volumes stay in the output folder; `finished` is called after each run with all there are. What cannot be learned in
/// its time is told to the console and kept as failed. Throws UsageError, Error where a scene cannot be rendered,
/// Interrupted.
void study_extraction(const ExtractionOptions& options, app::Console& console,
                      const std::function<void(const std::vector<ExtractionRun>&)>& finished);

/// Measures, and writes extraction.json, extraction.md and the diagrams into the output folder, anew after each run; prints
/// the table. Throws UsageError where another study is in the way.
void run_extraction_command(const ExtractionOptions& options, app::Console& console);

/// Runs that differ by their seed alone.
struct ExtractionGroup {
  std::string scene;
  ViewSet views;
  double planned_s = 0.0;
  std::vector<const ExtractionRun*> ended;  ///< of them, those that did not fail
};

/// In the order of their first run.
std::vector<ExtractionGroup> groups_of(const std::vector<ExtractionRun>& runs);

/// A quantity of a run, as &ExtractionRun::iou.
using ExtractionQuantity = double ExtractionRun::*;

/// Over the seeds. Not a number where nothing was measured.
struct Spread {
  double mean = ExtractionRun::kUnknown, least = ExtractionRun::kUnknown, most = ExtractionRun::kUnknown;
};
Spread spread_of(const ExtractionGroup& group, ExtractionQuantity quantity);

/// Diagrams and the names of their files: for each scene IoU and visible-surface Chamfer distance, against seconds of training
/// (a line for each set of views) and against the number of views (a line for each planned time, and carving). Means over
/// seeds, bars from the least to the largest. Without what failed.
std::vector<std::pair<std::string, Plot>> extraction_diagrams(const std::vector<ExtractionRun>& runs);

/// A row for each scene, set of views and time, means over seeds, in Markdown.
std::string extraction_table(const std::vector<ExtractionRun>& runs);

nlohmann::json extraction_json(const std::vector<ExtractionRun>& runs);

}  // namespace sarnerf::bench
