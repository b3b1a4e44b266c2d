// SPDX-License-Identifier: Apache-2.0
#include "curve.h"

#include <algorithm>

#include "sarnerf/core/metrics.h"
#include "sarnerf/core/stopwatch.h"
#include "sarnerf/dataset/evaluation.h"
#include "view_choice.h"

namespace sarnerf::app {
namespace {

constexpr std::size_t kMostViews = 8;
constexpr double kShare = 0.1;         ///< of the time, at most
constexpr double kPointsPerSpan = 30;  ///< more are not seen in a diagram

}  // namespace

Curve::Curve(std::span<const PosedImage> validation, double peak_power)
    : validation_(validation),
      views_(spread_places(validation.size(), kMostViews)),
      peak_power_(peak_power) {}

std::optional<double> Curve::measure_if_due(const LearnedField& field, double now_s) {
  if (views_.empty()) return std::nullopt;
  if (!first_s_) next_s_ = *(first_s_ = now_s) + 0.1;
  if (now_s < next_s_) return std::nullopt;
  const double before_s = spent_s_;
  measure(field);
  const double cost_s = spent_s_ - before_s;
  // Costs change as voxels are halved and pruned, hence a margin.
  next_s_ = now_s + cost_s + std::max(1.25 * cost_s / kShare, (now_s - *first_s_) / kPointsPerSpan);
  return last_db_;
}

double Curve::measure(const LearnedField& field) {
  const Stopwatch watch;
  double sum_db = 0.0;
  for (const std::size_t n : views_) {
    const PosedImage& truth = validation_[n];
    sum_db += std::min(kMostPsnr_db,
                       psnr_db(render_view(field, truth.acquisition), truth.power, peak_power_));
  }
  last_db_ = sum_db / static_cast<double>(views_.size());
  spent_s_ += watch.seconds();
  return *last_db_;
}

}  // namespace sarnerf::app
