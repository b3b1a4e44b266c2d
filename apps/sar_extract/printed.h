// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "options.h"
#include "recipe_file.h"
#include "sarnerf/nerf/model_file.h"
#include "scoring.h"

namespace sarnerf::app {

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

}  // namespace sarnerf::app
