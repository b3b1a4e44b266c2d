// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "extraction.h"
#include "sarnerf/report/plot.h"

namespace sarnerf::bench {

/// Diagrams and the names of their files: for each scene IoU and visible-surface Chamfer distance, against seconds of training
/// (a line for each set of views) and against the number of views (a line for each planned time, and carving). Means over
/// seeds, bars from the least to the largest. Without what failed.
std::vector<std::pair<std::string, Plot>> extraction_diagrams(const std::vector<ExtractionRun>& runs);

/// A row for each scene, set of views and time, means over seeds, in Markdown.
std::string extraction_table(const std::vector<ExtractionRun>& runs);

nlohmann::json extraction_json(const std::vector<ExtractionRun>& runs);

}  // namespace sarnerf::bench
