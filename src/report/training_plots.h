// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "sarnerf/report/page.h"
#include "sarnerf/report/training_report.h"

namespace sarnerf {

/// PSNR against seconds, the baselines as horizontal lines. Nothing when there is no finite point.
std::optional<PagePlot> curve_plot(const TrainingReport& report);

/// PSNR in power of the held-out views over their azimuth or incidence: the mean of the views there, for the model
/// with a bar from the lowest to the highest. Nothing when the views share one angle or have no finite score.
std::optional<PagePlot> azimuth_plot(const TrainingReport& report);
std::optional<PagePlot> incidence_plot(const TrainingReport& report);

}  // namespace sarnerf
