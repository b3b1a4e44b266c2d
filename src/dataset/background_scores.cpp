// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/background_scores.h"

#include <algorithm>
#include <cmath>

#include "mean_of_present.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/local_maxima.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/dataset/evaluation.h"

namespace sarnerf {
namespace {

std::optional<double> scatterer_error_m(const Image<float>& power, const PosedImage& truth,
                                        double floor, const BackgroundRule& rule) {
  const Acquisition& a = truth.acquisition;
  const MaximaRule maxima{rule.n_scatterers, rule.separation_m, a.azimuth_spacing_m,
                          a.range_spacing_m};
  const auto expected = strongest_maxima(truth.power, floor, maxima);
  if (expected.empty()) return std::nullopt;
  const auto found = strongest_maxima(power, 0.0, maxima);
  if (found.empty())
    return std::hypot(a.n_azimuth * a.azimuth_spacing_m, a.n_range * a.range_spacing_m);
  return mean_distance_m(expected, found, maxima);
}

}  // namespace

BackgroundScores score_background(const Image<float>& power, const PosedImage& truth, double peak,
                                  const BackgroundRule& rule) {
  BackgroundScores scores;
  const double error_db = log_amplitude_error_db(power, truth.power, peak, rule.range_db);
  scores.log_amplitude_error_db = error_db;
  scores.log_amplitude_psnr_db =
      error_db > 0.0 ? std::min(kMostPsnr_db, 20.0 * std::log10(rule.range_db / error_db))
                     : kMostPsnr_db;
  const auto expected = find_regions(truth.power, rule.regions);
  if (!expected) return scores;
  scores.looks = equivalent_looks(power, rule.looks, &expected->background);
  scores.looks_of_truth = equivalent_looks(truth.power, rule.looks, &expected->background);

  Regions found{0.0, Image<std::uint8_t>(power.n_azimuth(), power.n_range()), {}, {}};
  found.shadow = found.target;
  if (auto regions = find_regions(power, rule.regions)) found = std::move(*regions);
  scores.target_iou = intersection_over_union(found.target, expected->target);
  scores.shadow_iou = intersection_over_union(found.shadow, expected->shadow);

  const double floor = expected->background_power * std::pow(10.0, 0.1 * rule.regions.target_db);
  scores.scatterer_error_m = scatterer_error_m(power, truth, floor, rule);
  return scores;
}

BackgroundScores mean_of(std::span<const BackgroundScores> views) {
  if (views.empty()) throw UsageError("no views, no mean");
  const auto mean = [&](auto member) {
    return mean_of_present(views, [&](const BackgroundScores& s) { return std::optional<double>(s.*member); });
  };
  const auto harmonic_mean = [&](auto member) -> std::optional<double> {
    const auto fluctuation = mean_of_present(views, [&](const BackgroundScores& s) {
      return s.*member ? std::optional(1.0 / *(s.*member)) : std::nullopt;
    });
    if (!fluctuation) return std::nullopt;
    return 1.0 / *fluctuation;
  };
  using S = BackgroundScores;
  return {*mean(&S::log_amplitude_error_db), *mean(&S::log_amplitude_psnr_db),
          harmonic_mean(&S::looks),          harmonic_mean(&S::looks_of_truth),
          mean(&S::target_iou),              mean(&S::shadow_iou),
          mean(&S::scatterer_error_m)};
}

}  // namespace sarnerf
