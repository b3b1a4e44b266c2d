// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "study_accuracy.h"

namespace sarnerf::bench {
namespace {

nlohmann::json json_of(const Accuracy& a) {
  nlohmann::json j{{"engine", a.engine},
                   {"elevations", a.n_elevation},
                   {"sub_rows", a.n_sub_rows},
                   {"automatic", a.automatic},
                   {"ms", a.seconds * 1e3},
                   {"error", a.error},
                   {"db_error_p95", a.db_error},
                   {"estimate", a.estimate},
                   {"estimating_over_not", a.estimating}};
  if (a.voxel_bins > 0.0) {
    j["voxel_bins"] = a.voxel_bins;
    j["integrator"] = a.integrator;
  }
  return j;
}

nlohmann::json json_of(const ToleranceResult& t) {
  return {{"tolerance", t.tolerance},     {"elevations", t.n_elevation}, {"sub_rows", t.n_sub_rows},
          {"renders", t.n_renders},       {"ms", t.seconds * 1e3},       {"estimate", t.estimate},
          {"error", t.error},             {"best_ms", t.best_s * 1e3},   {"time_over_best", t.seconds / t.best_s},
          {"rays_over_best", t.n_rays / t.best_n_rays}};
}

}  // namespace

nlohmann::json accuracy_json(const std::vector<SceneAccuracy>& results) {
  nlohmann::json scenes = nlohmann::json::array();
  std::size_t n_estimates = 0, n_good = 0, n_tolerances = 0, n_met = 0, n_cheap = 0;
  for (const SceneAccuracy& scene : results) {
    nlohmann::json settings = nlohmann::json::array(), tolerances = nlohmann::json::array();
    for (const Accuracy& a : scene.settings) {
      settings.push_back(json_of(a));
      if (a.integrator != "exact" || std::isnan(a.estimate)) continue;
      ++n_estimates;
      n_good += a.estimate >= 0.5 * a.error && a.estimate <= 3.0 * a.error;
    }
    for (const ToleranceResult& t : scene.tolerances) {
      tolerances.push_back(json_of(t));
      ++n_tolerances;
      n_met += t.error <= t.tolerance;
      n_cheap += t.seconds <= 2.0 * t.best_s;
    }
    scenes.push_back({{"scene", scene.scene}, {"settings", settings}, {"tolerances", tolerances}});
  }
  return {{"scenes", scenes},
          {"estimates", {{"renders", n_estimates}, {"between_half_and_three_times_the_error", n_good}}},
          {"tolerances", {{"asked", n_tolerances}, {"met", n_met}, {"within_twice_the_best_time", n_cheap}}}};
}

}  // namespace sarnerf::bench
