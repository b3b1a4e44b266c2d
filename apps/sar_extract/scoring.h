// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "console.h"
#include "options.h"
#include "recipe_file.h"
#include "sarnerf/bake/score.h"
#include "sarnerf/core/monitor.h"

namespace sarnerf::app {

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

}  // namespace sarnerf::app
