// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <vector>

#include "plan.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/render/engine.h"
#include "studies.h"
#include "surface/surface_scene.h"

namespace sarnerf::bench {

namespace {

/// Exactly the rays that the surface engine keeps for one view, prepared beforehand so that only tracing is left: the
/// lower bound that the engine is measured against.
class KeptRays {
 public:
  KeptRays(const Scene& scene, const ViewPlan& plan);

  std::size_t count() const { return count_; }

  void trace_row_packets();     ///< packets of 16 neighbours along a slice
  void trace_square_packets();  ///< packets of 4 slices by 4 rays
  void trace_one_by_one();

 private:
  struct Block {
    std::size_t first, n_rays;
    std::vector<std::vector<float>> x, y, z;  ///< origins, one array per slice
  };
  RayRow row(const Block& block, std::size_t slice) const;
  HitRow hits(std::size_t slice, std::size_t n);

  TriangleSubset mesh_;
  RayTracer tracer_;
  ViewRays rays_;
  std::vector<Block> blocks_;
  std::size_t count_ = 0;
  std::vector<float> distance_, normal_x_, normal_y_, normal_z_;
  std::vector<std::uint32_t> triangle_;
};

TriangleSubset whole_mesh(const Scene& scene) {
  std::vector<std::uint32_t> all(scene.mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return take_triangles(scene.mesh, all, scene.box.centre());
}

KeptRays::KeptRays(const Scene& scene, const ViewPlan& plan)
    : mesh_(whole_mesh(scene)),
      tracer_(vertices(mesh_.vertices_m), mesh_.triangles),
      rays_(plan.acquisition, plan.fan, scene.box.centre(),
            VisibleExtent(plan.acquisition, scene.box).range_offsets_m()) {
  const VisibleExtent extent(plan.acquisition, scene.box);
  const Acquisition& a = plan.acquisition;
  const double width_m = a.azimuth_spacing_m / plan.n_slices;
  constexpr int kBlock = static_cast<int>(RayTracer::kRowsPerBlock);
  for (int i = 0; i < a.n_azimuth; ++i) {
    for (int sub = 0; sub < plan.n_slices; sub += kBlock) {
      const int n_slices = std::min(kBlock, plan.n_slices - sub);
      const double along_m = a.row_offset_m(i - 0.5) + (sub + 0.5) * width_m;
      const RayRange kept =
          rays_inside(plan.fan, extent.angles(along_m, along_m + (n_slices - 1) * width_m));
      if (kept.count == 0) continue;
      const auto first = static_cast<std::size_t>(kept.first);
      const std::size_t end = first + static_cast<std::size_t>(kept.count);
      Block block{first, end - first, {}, {}, {}};
      for (int s = 0; s < n_slices; ++s) {
        const glm::dvec3 shift = (along_m + s * width_m) * rays_.grid.frame().h;
        const auto shifted = [&](const std::vector<double>& from, double by) {
          std::vector<float> to;
          for (std::size_t k = first; k < end; ++k) to.push_back(static_cast<float>(from[k] + by));
          return to;
        };
        block.x.push_back(shifted(rays_.origin_x, shift.x));
        block.y.push_back(shifted(rays_.origin_y, shift.y));
        block.z.push_back(shifted(rays_.origin_z, shift.z));
        count_ += block.n_rays;
      }
      blocks_.push_back(std::move(block));
    }
  }
  const auto scratch = static_cast<std::size_t>(plan.fan.n_elevation) * RayTracer::kRowsPerBlock;
  for (auto* array : {&distance_, &normal_x_, &normal_y_, &normal_z_}) array->resize(scratch);
  triangle_.resize(scratch);
}

RayRow KeptRays::row(const Block& block, std::size_t slice) const {
  const auto part = [&](const std::vector<float>& all) {
    return std::span(all).subspan(block.first, block.n_rays);
  };
  return {block.x[slice],          block.y[slice],          block.z[slice],
          part(rays_.direction_x), part(rays_.direction_y), part(rays_.direction_z),
          rays_.far_m};
}

HitRow KeptRays::hits(std::size_t slice, std::size_t n) {
  const auto part = [&](auto& all) { return std::span(all).subspan(slice * n, n); };
  return {part(distance_), part(normal_x_), part(normal_y_), part(normal_z_), part(triangle_)};
}

void KeptRays::trace_row_packets() {
  for (const Block& block : blocks_) {
    for (std::size_t s = 0; s < block.x.size(); ++s) {
      const RayRow rays = row(block, s);
      const HitRow found = hits(s, block.n_rays);
      tracer_.first_hits({&rays, 1}, {&found, 1});
    }
  }
}

void KeptRays::trace_square_packets() {
  for (const Block& block : blocks_) {
    std::vector<RayRow> rows;
    std::vector<HitRow> found;
    for (std::size_t s = 0; s < block.x.size(); ++s) {
      rows.push_back(row(block, s));
      found.push_back(hits(s, block.n_rays));
    }
    tracer_.first_hits(rows, found);
  }
}

void KeptRays::trace_one_by_one() {
  for (const Block& block : blocks_) {
    for (std::size_t s = 0; s < block.x.size(); ++s) {
      tracer_.first_hits_one_by_one(row(block, s), hits(s, block.n_rays));
    }
  }
}

}  // namespace

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
    // The full grid's time is that of the kept rays scaled up, as if single rays cost the same everywhere. This
    // neglects that the full grid's misses are cheaper, by at most a half.
    Timing full_grid = times[3];
    for (double& s : full_grid.seconds) s *= static_cast<double>(plan.n_grid_rays) / count;
    results.push_back({{"scene", named.name},
                       {"triangles", named.scene.mesh.triangles.size()},
                       {"elevations", plan.fan.n_elevation},
                       {"sub_rows", plan.n_slices},
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
