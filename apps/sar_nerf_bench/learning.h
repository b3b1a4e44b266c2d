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

/// Where a run stood at one moment.
struct LearningPoint {
  double seconds = 0.0;      ///< wall clock since the start, loading included, scoring excluded
  double cpu_seconds = 0.0;  ///< of all threads, the same way
  std::int64_t step = 0;
  double psnr_db = 0.0;  ///< of power, mean over the study's views
};

/// One contestant, trained once.
struct LearningRun {
  std::string field;  ///< grid, mlp or plain
  double planned_s = 0.0;
  std::uint64_t seed = 1;
  double start_s = 0.0;                ///< of its time, until the first step began
  std::vector<LearningPoint> points;   ///< the last is the end
  std::string diverged;                ///< the message, if it did
};

/// All that was measured on one dataset.
struct LearningStudy {
  std::string dataset;
  int n_training_views = 0;
  std::vector<std::string> views;  ///< that all are scored on
  double peak_power = 0.0;
  std::vector<std::pair<std::string, double>> baselines;  ///< name, PSNR of power on these views (dB)
  std::vector<LearningRun> runs;
};

/// The best of a study's baselines; null without any.
const std::pair<std::string, double>* best_baseline(const LearningStudy& study);

/// Fields in the order of their first run.
std::vector<std::string> fields_of(const LearningStudy& study);

/// Seconds at which a run reached a PSNR, linear in the logarithm of the time between two scores; the
/// first score's where that is above already. None where it never did.
std::optional<double> seconds_to(const LearningRun& run, double psnr_db);

/// The same of a field: for each seed the earliest of its runs, whatever they were planned for; of the
/// seeds the median, none where half of them or more never did.
std::optional<double> seconds_to(const LearningStudy& study, const std::string& field,
                                 double psnr_db);

/// PSNR against seconds. Of a field with runs of several planned times: what each run had reached at its
/// end, joined, and dashed the course of the longest; else the course of its run. Bars reach from the
/// worst seed to the best. The best baseline is a horizontal line.
Plot learning_diagram(const LearningStudy& study);

/// Two tables in Markdown: seconds to 30, 35, 40, 45 and 48 dB (and to what `plain` had in the end), and
/// the runs, means over seeds.
std::string learning_tables(const LearningStudy& study);

nlohmann::ordered_json learning_json(const LearningStudy& study);

}  // namespace sarnerf::bench
