// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "sarnerf/report/plot.h"

namespace sarnerf::bench {

/// State of a run at one moment.
struct LearningPoint {
  double seconds = 0.0;      ///< wall clock since the start, loading included, scoring excluded
  double cpu_seconds = 0.0;  ///< of all threads, likewise
  std::int64_t step = 0;
  double psnr_db = 0.0;  ///< of power, mean over the study's views
};

/// One contestant, trained once.
struct LearningRun {
  std::string field;  ///< grid, surface, mlp or paper
  double planned_s = 0.0;
  std::uint64_t seed = 1;
  double start_s = 0.0;                ///< its time until the first step began
  std::vector<LearningPoint> points;   ///< the last is the end
  std::string diverged;                ///< the error message, if the run diverged
};

/// All that was measured on one dataset.
struct LearningStudy {
  std::string dataset;
  int n_training_views = 0;
  std::vector<std::string> views;  ///< on which all runs are scored
  double peak_power = 0.0;
  std::vector<std::pair<std::string, double>> baselines;  ///< name, PSNR of power on these views (dB)
  std::vector<LearningRun> runs;
};

/// The best of a study's baselines; null without any.
const std::pair<std::string, double>* best_baseline(const LearningStudy& study);

/// Fields in the order of their first run.
std::vector<std::string> fields_of(const LearningStudy& study);

/// Seconds at which a run reached a PSNR: interpolated between two scores, linearly in the logarithm of the time, or
/// the time of the first score if that is above already. Nothing if the run never reached it.
std::optional<double> seconds_to(const LearningRun& run, double psnr_db);

/// The same for a field: the median over the seeds of the earliest time among a seed's runs, whatever their planned
/// times. Nothing if half of the seeds or more never reached it.
std::optional<double> seconds_to(const LearningStudy& study, const std::string& field,
                                 double psnr_db);

/// PSNR against seconds. A field with runs of several planned times has a line through the ends of its runs, and a
/// dashed curve of its longest run; else the curve of its run. Bars reach from the worst seed to the best. The best
/// baseline is a horizontal line.
Plot learning_diagram(const LearningStudy& study);

/// Two tables in Markdown: seconds to 30, 35, 40, 45 and 48 dB (and to the best score of `paper`), and the runs,
/// means over seeds.
std::string learning_tables(const LearningStudy& study);

nlohmann::ordered_json learning_json(const LearningStudy& study);

}  // namespace sarnerf::bench
