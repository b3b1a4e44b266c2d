// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/parallel.h"
#include "sarnerf/render/surface_engine.h"
#include "sarnerf/render/voxel_engine.h"
#include "sarnerf/scene/voxelise.h"
#include "studies.h"
#include "timing.h"
#include "view.h"

namespace sarnerf::bench {

nlohmann::json study_threads(const StudyOptions& options, int n_threads) {
  nlohmann::json results = nlohmann::json::array();
  for (const NamedScene& named : load_scenes(options)) {
    const SurfaceEngine surface(named.scene);
    VoxeliseOptions voxelising;
    voxelising.voxel_size_m = options.spacing_m;
    const VoxelEngine voxel(named.scene, to_volume(voxelise(named.scene, voxelising)));
    const Acquisition view = standard_view(named.scene, options);
    const auto render = [&](const Engine& engine, const ViewPlan& plan, int threads) {
      return [&engine, plan, threads] {
        const ThreadLimit limit(threads);
        engine.render(plan);
      };
    };
    // Plans count threads.
    ViewPlan surface_plan = surface.plan(view, {}), voxel_plan = voxel.plan(view, {});
    surface_plan.error.estimate = voxel_plan.error.estimate = false;
    const auto times = run_in_turn({render(surface, surface_plan, 1), render(surface, surface_plan, n_threads),
                                    render(voxel, voxel_plan, 1), render(voxel, voxel_plan, n_threads)},
                                   options.rounds);
    results.push_back({{"scene", named.name},
                       {"threads", n_threads},
                       {"surface_ms", times[0].median() * 1e3},
                       {"surface_speed_up", ratio_json(times[0], times[1])},
                       {"voxel_ms", times[2].median() * 1e3},
                       {"voxel_speed_up", ratio_json(times[2], times[3])},
                       {"voxel_over_surface", ratio_json(times[2], times[0])}});
  }
  return results;
}

}  // namespace sarnerf::bench
