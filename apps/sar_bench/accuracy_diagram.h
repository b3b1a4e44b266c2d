// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/report/plot.h"
#include "study_accuracy.h"

namespace sarnerf::bench {

/// The work–precision diagram of one scene: error over time of every setting, both logarithmic, with the
/// settings that nothing beats joined by a line.
Plot accuracy_diagram(const SceneAccuracy& scene);

/// Scenes by settings, as Markdown: what the automatic setting, coarser and finer ones, and tolerances give.
std::string accuracy_table(const std::vector<SceneAccuracy>& scenes);

}  // namespace sarnerf::bench
