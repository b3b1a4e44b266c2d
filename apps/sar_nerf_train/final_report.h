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

/// The plan for people: what is learned from what, for how long, and what is left out and why.
std::string explain(const Options& options, const Data& data, const Trainer& trainer);

/// What a run does without, and why: pairs of both.
std::vector<std::pair<std::string, std::string>> left_out(const Options& options, const Data& data);

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

/// The run as its report shows it.
TrainingReport report_of(const ReportInput& input, const Findings& findings);

}  // namespace sarnerf::app
