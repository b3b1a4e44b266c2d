// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "sarnerf/dataset/despeckled_evaluation.h"

namespace sarnerf::app {

/// --despeckle's degrees; 0 for "off". Throws UsageError for what is not in (0, 90].
double parse_despeckle_deg(const std::string& text);

/// The despeckled truth of views that nobody trained on; none where the option is off. Throws UsageError where no view
/// has the neighbours that it takes.
std::optional<DespeckledTruth> despeckled_if_asked(double despeckle_deg,
                                                   std::span<const PosedImage> unseen);

/// What the truth is, above its table.
std::string despeckled_title(double despeckle_deg, const DespeckledTruth& truth);

}  // namespace sarnerf::app
