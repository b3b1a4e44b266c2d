// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies.h"

namespace sarnerf::bench {

/// One setting of one scene: what it costs and how far it is from the reference.
struct Accuracy {
  std::string engine;
  std::string integrator = "exact";
  double voxel_bins = 0.0;  ///< side in range bins; 0 for the surface engine
  int n_elevation = 0, n_sub_rows = 0;
  bool automatic = false;
  double seconds = 0.0;
  double error = 0.0;       ///< E against the reference
  double db_error = 0.0;    ///< 95th percentile within 30 dB of the peak
  double estimate = 0.0;    ///< of E, by the render itself
  double estimating = 1.0;  ///< time with the estimate over time without
};

/// What asking for a tolerance gave.
struct ToleranceResult {
  double tolerance = 0.0;
  int n_elevation = 0, n_sub_rows = 0, n_renders = 0;
  double seconds = 0.0;  ///< pilots and all
  double estimate = 0.0, error = 0.0;
  double n_rays = 0.0;   ///< elevations × slices a row, pilots and all: the cost that does not depend on the clock
  double best_n_rays = std::numeric_limits<double>::quiet_NaN();  ///< least of a swept setting that meets it
  double best_s = std::numeric_limits<double>::quiet_NaN();  ///< of the cheapest swept setting that meets it
};

struct SceneAccuracy {
  std::string scene;
  std::vector<Accuracy> settings;
  std::vector<ToleranceResult> tolerances;
};

/// Error against time of every setting, for each scene, against a converged reference; and what --error makes of
/// it. One thread.
std::vector<SceneAccuracy> study_accuracy(const StudyOptions& options);

nlohmann::json accuracy_json(const std::vector<SceneAccuracy>& results);

}  // namespace sarnerf::bench
