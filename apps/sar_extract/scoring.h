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
  std::optional<SurfaceScore> carved;
  double seconds = 0.0;
};

/// The truth as the program takes it.
struct Truth {
  TruthSurface surface;
  TruthVolume volume = TruthVolume::closed_pieces;
};

/// Reads it, and tells the console what was mended. A truth of thin shells too counts by what it encloses.
Truth load_truth(const Options& options, Console& console, const Monitor& monitor);

/// Warns of a truth of another size, and where the baseline has to be left out.
Scores score_extraction(const Options& options, const Truth& truth, const Model& model, const Extraction& extraction,
                        Console& console, const Monitor& monitor);

/// Markdown, for people.
std::string table_text(const Scores& scores);

Json scores_json(const Scores& scores);

}  // namespace sarnerf::app
