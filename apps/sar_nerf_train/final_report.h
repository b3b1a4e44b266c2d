// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "lpips_option.h"
#include "sarnerf/dataset/evaluation.h"
#include "stage_times.h"
#include "training_run.h"

namespace sarnerf::app {

/// What a report tells of.
struct ReportInput {
  const Options& options;
  const Data& data;
  const Trainer& trainer;
  const TrainingRun& run;
  const RunFolder& folder;
  const std::string& config;
  const ImageDistance& lpips;
};

/// What was found out for it.
struct Findings {
  std::optional<Evaluation> evaluation;   ///< of all views kept away from training
  std::optional<Evaluation> despeckled;   ///< of their despeckled truth, where asked for
  std::vector<Image<float>> predictions;  ///< of them
  std::string lpips_missing;              ///< why there is no LPIPS
  StageTimes times;
};

/// Predicts and judges the validation views, and writes val/, report.html and, last, report.json.
void write_reports(const ReportInput& input, StageTimes times, Console& console,
                   const Monitor& monitor);

}  // namespace sarnerf::app
