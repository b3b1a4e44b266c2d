// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "generated.h"
#include "kept_rays.h"
#include "sarnerf/core/parallel.h"
#include "studies.h"
#include "timing.h"
#include "view.h"

namespace sarnerf::bench {

nlohmann::json study_engine(const StudyOptions& options) {
  const ThreadLimit one_thread(1);
  nlohmann::json results = nlohmann::json::array();
  for (const NamedScene& named : load_scenes(options)) {
    const SurfaceEngine engine(named.scene);
    const ViewPlan told = engine.plan(standard_view(named.scene, options), {});
    ViewPlan plan = told;
    plan.error.estimate = false;
    KeptRays bare(named.scene, plan);
    const auto times = run_in_turn({[&] { engine.render(plan); }, [&] { bare.trace_row_packets(); },
                                    [&] { bare.trace_square_packets(); },
                                    [&] { bare.trace_one_by_one(); }, [&] { engine.render(told); }},
                                   options.rounds);
    const auto count = static_cast<double>(bare.count());
    // Single rays cost the same wherever they go, so the full grid is the kept rays scaled up; that
    // favours the full grid's misses, which are cheaper, by at most a half.
    Timing full_grid = times[3];
    for (double& s : full_grid.seconds) s *= static_cast<double>(plan.n_grid_rays) / count;
    results.push_back({{"scene", named.name},
                       {"triangles", named.scene.mesh.triangles.size()},
                       {"elevations", plan.fan.n_elevation},
                       {"sub_rows", plan.n_sub_rows},
                       {"kept_rays", bare.count()},
                       {"grid_rays", plan.n_grid_rays},
                       {"view_ns_per_kept_ray", nanoseconds_json(times[0], count)},
                       {"view_with_error_estimate_over_view", ratio_json(times[4], times[0])},
                       {"embree_16_row_ns", nanoseconds_json(times[1], count)},
                       {"embree_16_square_ns", nanoseconds_json(times[2], count)},
                       {"embree_single_ns", nanoseconds_json(times[3], count)},
                       {"view_over_embree_16_row", ratio_json(times[0], times[1])},
                       {"view_over_embree_16_square", ratio_json(times[0], times[2])},
                       {"view_over_full_grid_of_single_rays", ratio_json(times[0], full_grid)}});
  }
  return results;
}

nlohmann::json study_triangles(const StudyOptions& options) {
  const ThreadLimit one_thread(1);
  const Scene coarse = bumpy_sphere(12'000, 8.0), fine = bumpy_sphere(1'200'000, 8.0);
  const SurfaceEngine coarse_engine(coarse), fine_engine(fine);
  const ViewPlan coarse_plan = coarse_engine.plan(standard_view(coarse, options), {});
  const ViewPlan fine_plan = fine_engine.plan(standard_view(fine, options), {});
  const auto times = run_in_turn(
      {[&] { fine_engine.render(fine_plan); }, [&] { coarse_engine.render(coarse_plan); }},
      options.rounds);
  const auto rays = [](const ViewPlan& plan) { return static_cast<double>(plan.n_kept_rays); };
  return {{"triangles", {coarse.mesh.triangles.size(), fine.mesh.triangles.size()}},
          {"kept_rays", {coarse_plan.n_kept_rays, fine_plan.n_kept_rays}},
          {"coarse_ns_per_kept_ray", nanoseconds_json(times[1], rays(coarse_plan))},
          {"fine_ns_per_kept_ray", nanoseconds_json(times[0], rays(fine_plan))},
          {"fine_over_coarse", ratio_json(times[0], times[1])},
          {"build_s", {coarse_engine.build_s(), fine_engine.build_s()}}};
}

}  // namespace sarnerf::bench
