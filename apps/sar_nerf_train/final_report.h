// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nerf_common.h"
#include "options.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/nerf/trainer.h"
#include "sarnerf/report/training_report.h"
#include "training_run.h"

namespace sarnerf::app {

/// Where the program's time went: wall-clock seconds by stage, in order.
struct StageTimes {
  std::vector<std::pair<std::string, double>> stages;
  void add(std::string name, double seconds) { stages.emplace_back(std::move(name), seconds); }
};

/// The plan as text: images, field, loss, length of training, and what is left out and why.
std::string explain(const Options& options, const Data& data, const Trainer& trainer);

/// Pairs of what a run leaves out, and why.
std::vector<std::pair<std::string, std::string>> left_out(const Options& options, const Data& data);

/// Input of the reports.
struct ReportInput {
  const Options& options;
  const Data& data;
  const Trainer& trainer;
  const TrainingRun& run;
  const RunFolder& folder;
  const std::string& config;
  const ImageDistance& lpips;
};

/// Results for the reports.
struct Findings {
  std::optional<Evaluation> evaluation;   ///< of all validation views
  std::optional<Evaluation> despeckled;   ///< of their despeckled truth, if requested
  std::vector<Image<float>> predictions;  ///< of the validation views
  std::string lpips_missing;              ///< why there is no LPIPS
  StageTimes times;
};

/// Predicts and scores the validation views, and writes val/, report.html and, last, report.json.
void write_reports(const ReportInput& input, StageTimes times, Console& console,
                   const Monitor& monitor);

/// The run as its report shows it.
TrainingReport report_of(const ReportInput& input, const Findings& findings);

}  // namespace sarnerf::app
