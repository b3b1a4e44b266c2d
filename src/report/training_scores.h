// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sarnerf/report/page.h"
#include "sarnerf/report/training_report.h"

namespace sarnerf {

/// The baseline of the highest mean PSNR in power, and by how much the model is above it.
struct Margin {
  const ReportMethod* best = nullptr;
  double over_db = 0.0;
};

/// Nothing without a model, a baseline or their PSNR in power.
std::optional<Margin> margin_over_baselines(const TrainingReport& report);

/// "PSNR 48.21 dB in power, 39.40 dB in amplitude, SSIM 0.998"; empty without scores.
std::string scores_in_words(const ReportScores& scores);

/// The means of a comparison with another truth.
PageTable comparison_table(const ReportComparison& comparison);

/// The methods' means, one row each, the model first.
PageTable score_table(const TrainingReport& report);

/// The model's scores of every held-out view beside the best baseline's PSNR, folded.
PageTable view_table(const TrainingReport& report);

}  // namespace sarnerf
