// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/report/page.h"
#include "sarnerf/report/training_report.h"

namespace sarnerf {

/// The scales, what they mean, and truth, prediction and difference of each shown view. Nothing without views.
/// Throws UsageError where a view's images differ in size.
std::vector<PageBlock> picture_blocks(const TrainingReport& report);

/// `value` rounded up to 1, 2 or 5 times a power of ten; 1 for what is not positive and finite.
double round_limit(double value);

}  // namespace sarnerf
