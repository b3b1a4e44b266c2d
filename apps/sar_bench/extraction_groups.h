// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "extraction.h"

namespace sarnerf::bench {

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

}  // namespace sarnerf::bench
