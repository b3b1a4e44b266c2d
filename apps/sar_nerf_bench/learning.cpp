// SPDX-License-Identifier: Apache-2.0
#include "learning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace sarnerf::bench {

const std::pair<std::string, double>* best_baseline(const LearningStudy& study) {
  const auto best =
      std::ranges::max_element(study.baselines, {}, &std::pair<std::string, double>::second);
  return best == study.baselines.end() ? nullptr : &*best;
}

std::vector<std::string> fields_of(const LearningStudy& study) {
  std::vector<std::string> fields;
  for (const LearningRun& run : study.runs) {
    if (std::ranges::find(fields, run.field) == fields.end()) fields.push_back(run.field);
  }
  return fields;
}

std::optional<double> seconds_to(const LearningRun& run, double psnr_db) {
  const LearningPoint* before = nullptr;
  for (const LearningPoint& p : run.points) {
    if (p.psnr_db >= psnr_db) {
      if (before == nullptr) return p.seconds;
      const double share = (psnr_db - before->psnr_db) / (p.psnr_db - before->psnr_db);
      return before->seconds * std::pow(p.seconds / before->seconds, share);
    }
    before = &p;
  }
  return std::nullopt;
}

std::optional<double> seconds_to(const LearningStudy& study, const std::string& field,
                                 double psnr_db) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  std::map<std::uint64_t, double> earliest_s;
  for (const LearningRun& run : study.runs) {
    if (run.field != field) continue;
    const double s = seconds_to(run, psnr_db).value_or(kNever);
    const auto [entry, is_new] = earliest_s.try_emplace(run.seed, s);
    if (!is_new) entry->second = std::min(entry->second, s);
  }
  if (earliest_s.empty()) return std::nullopt;
  std::vector<double> sorted;
  for (const auto& [seed, s] : earliest_s) sorted.push_back(s);
  std::ranges::sort(sorted);
  const std::size_t n = sorted.size();
  const double median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
  return median < kNever ? std::optional(median) : std::nullopt;
}

}  // namespace sarnerf::bench
