// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "studies.h"
#include "timing.h"
#include "view.h"

namespace sarnerf::bench {

nlohmann::json study_accuracy(const StudyOptions& options) {
  const ThreadLimit one_thread(1);
  nlohmann::json results = nlohmann::json::array();
  for (const NamedScene& named : load_scenes(options)) {
    const SurfaceEngine engine(named.scene);
    const Acquisition view = standard_view(named.scene, options);
    const ViewPlan automatic = engine.plan(view, {});
    const int n_auto = automatic.fan.n_elevation;
    Sampling converged;
    converged.n_elevation = 8 * n_auto;
    converged.n_sub_rows = 128;
    const Image<float> reference = engine.render(engine.plan(view, converged)).beta0;

    for (const double density : {0.25, 0.5, 1.0, 2.0, 4.0}) {
      for (const int sub_rows : {1, 2, 4, 8, 16}) {
        Sampling sampling;
        sampling.n_elevation = std::max(1, static_cast<int>(n_auto * density));
        sampling.n_sub_rows = sub_rows;
        const ViewPlan plan = engine.plan(view, sampling);
        RenderedView rendered;
        ViewPlan by_direction = plan;
        by_direction.error.by_direction = true;
        ViewPlan without = plan;
        without.error.estimate = false;
        const auto times = run_in_turn({[&] { rendered = engine.render(by_direction); },
                                        [&] { engine.render(without); },
                                        [&] { engine.render(plan); }}, options.rounds);
        results.push_back(
            {{"scene", named.name},
             {"elevations", sampling.n_elevation},
             {"sub_rows", sub_rows},
             {"automatic", density == 1.0 && sub_rows == automatic.n_sub_rows},
             {"ms", times[0].median() * 1e3},
             {"estimate", rendered.error.relative},
             {"elevation", rendered.error.elevation},
             {"along_track", rendered.error.along_track},
             {"estimating", ratio_json(times[2], times[1])},
             {"estimating_apart", ratio_json(times[0], times[1])},
             {"error", relative_l2_error(rendered.beta0, reference)},
             {"db_error_p95", db_error_percentile(rendered.beta0, reference)}});
      }
    }
  }
  return results;
}

}  // namespace sarnerf::bench
