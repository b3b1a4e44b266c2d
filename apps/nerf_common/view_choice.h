// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/dataset/manifest.h"

namespace sarnerf::app {

/// How many views are kept away from training.
struct Holdout {
  enum class Kind { automatic, count, part };
  Kind kind = Kind::automatic;
  double value = 0.0;
};

/// "auto", a count or a part ("0.1", "10%"). Throws UsageError.
Holdout parse_holdout(const std::string& text);

/// Places of the views to hold out, in the dataset's order: evenly spread in the order of azimuth, then incidence.
/// `automatic`: every twelfth where there are at least 48, else none, for every view counts there. Throws UsageError
/// when no view is left to learn from.
std::vector<std::size_t> held_out_views(std::span<const DatasetView> views, const Holdout& holdout);

/// Up to `most` of `count` places, evenly spread, the first quarter step in.
std::vector<std::size_t> spread_places(std::size_t count, std::size_t most);

/// Whether two views were taken from the same direction, to a millionth of a degree, and side.
bool same_angles(const DatasetView& a, const DatasetView& b);

/// Places of the views whose angles no training view has.
std::vector<std::size_t> unseen_views(std::span<const DatasetView> views,
                                      std::span<const DatasetView> training);

}  // namespace sarnerf::app
