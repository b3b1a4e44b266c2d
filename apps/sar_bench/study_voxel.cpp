// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>

#include "sarnerf/core/metrics.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/vdb_scene.h"
#include "studies.h"
#include "plan.h"

namespace sarnerf::bench {
namespace {

struct Voxels {
  Volume volume;
  double voxelise_s = 0.0, to_volume_s = 0.0;
};

Voxels make_voxels(const Scene& scene, double voxel_size_m) {
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::time_point a, Clock::time_point b) {
    return std::chrono::duration<double>(b - a).count();
  };
  VoxeliseOptions options;
  options.voxel_size_m = voxel_size_m;
  const auto start = Clock::now();
  const VdbScene grids = voxelise(scene, options);
  const auto made = Clock::now();
  Voxels voxels{to_volume(grids), seconds(start, made), 0.0};
  voxels.to_volume_s = seconds(made, Clock::now());
  return voxels;
}

/// The same voxels without sparsity: every brick of the support's box exists, so that a sample in empty space costs
/// as much as any other.
Volume densified(const Volume& volume) {
  Volume dense = volume;
  const GridTransform transform = volume.grid.transform();
  const auto brick_at = [&](const glm::dvec3& point_m) {
    return brick_of_voxel(glm::ivec3(glm::floor(transform.index_from_world(point_m))));
  };
  const glm::ivec3 first = brick_at(volume.support_m.min), last = brick_at(volume.support_m.max);
  const glm::ivec3 n = last - first + 1;
  dense.grid = BrickGrid<float>(transform, volume.grid.n_channels());
  dense.grid.reserve_bricks(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  glm::ivec3 brick;
  for (brick.x = first.x; brick.x <= last.x; ++brick.x) {
    for (brick.y = first.y; brick.y <= last.y; ++brick.y) {
      for (brick.z = first.z; brick.z <= last.z; ++brick.z) {
        const std::uint32_t to = dense.grid.touch_brick(brick), from = volume.grid.topology().find(brick);
        if (from == kNoBrick) continue;
        std::copy_n(volume.grid.view().voxel(from, 0),
                    std::size_t{kBrickVoxels} * static_cast<std::size_t>(volume.grid.n_channels()),
                    dense.grid.view().voxel(to, 0));
      }
    }
  }
  return dense;
}

/// A ray march without any skipping: every ray of the plan that meets the volume's box is sampled all the way through
/// it, at the engine's step.
class DenseMarch {
 public:
  DenseMarch(const Volume& volume, const ViewPlan& plan)
      : plan_(plan), rays_(plan.acquisition, plan.fan), grid_(volume.grid.view()),
        channels_(volume.channels), box_(volume.support_m), extent_(plan.acquisition, volume.support_m) {
    grid_.transform.origin_m -= plan.acquisition.aim_m;
    box_ = {box_.min - plan.acquisition.aim_m, box_.max - plan.acquisition.aim_m};
  }

  /// Rays of every `stride`th row; returns how many.
  std::size_t march(int stride) {
    const Acquisition& a = plan_.acquisition;
    std::vector<double> bins(static_cast<std::size_t>(a.n_range));
    std::vector<float> extinction, back, source;
    std::vector<MarchRay> kept;
    std::size_t n_rays = 0;
    for (int i = 0; i < a.n_azimuth; i += stride) {
      for (int slice = 0; slice < plan_.n_slices; ++slice) {
        const double along_m = slice_along_m(a, i, slice, plan_.n_slices);
        const RayRange range = rays_inside(plan_.fan, extent_.angles(along_m, along_m));
        kept.clear();
        for (int k = range.first; k < range.first + range.count; ++k)
          kept.push_back({along_m, 0, k, clip_to_box(rays_, along_m, k, box_), slice, k});
        rows_.clear();
        rows_.begin_row(rays_, i, plan_.n_slices);
        rows_.cut(rays_, kept, 0.5 * grid_.transform.voxel_size_m);
        n_rays += kept.size();
        const SampleBatch& batch = rows_.batch();
        extinction.resize(batch.n_segments());
        source.resize(batch.n_segments());
        if (channels_.two_extinctions) back.resize(batch.n_segments());
        sample_field(grid_, channels_, batch.point_m, {batch.ray_begin, batch.ray_direction}, {extinction, back, source});
        rows_.set_field(extinction, source, back);
        rows_.integrate(rows_.rows().back(), channels_.basis, plan_.integrator, Deposit::in_bin, bins);
      }
    }
    return n_rays;
  }

 private:
  const ViewPlan& plan_;
  RayGrid rays_;
  BrickView<const float> grid_;
  FieldChannels channels_;
  Box box_;
  VisibleExtent extent_;
  AzimuthRows rows_;
};

/// The scene and a copy of it at a distance along the image's rows' direction.
Scene twice(const Scene& scene, const glm::dvec3& shift_m) {
  Scene both = scene;
  const auto n_vertices = static_cast<std::uint32_t>(scene.mesh.vertices_m.size());
  const auto n_pieces = static_cast<std::uint32_t>(scene.pieces.size());
  for (const glm::dvec3& v : scene.mesh.vertices_m) {
    both.mesh.vertices_m.push_back(v + shift_m);
    both.box.include(v + shift_m);
  }
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    both.mesh.triangles.push_back(scene.mesh.triangles[t] + n_vertices);
    both.mesh.material.push_back(scene.mesh.material[t]);
    both.mesh.piece.push_back(scene.mesh.piece[t] + n_pieces);
    both.mesh.group.push_back(scene.mesh.group[t]);
  }
  both.pieces.insert(both.pieces.end(), scene.pieces.begin(), scene.pieces.end());
  return both;
}

nlohmann::json empty_space(const Scene& scene, const StudyOptions& options) {
  const double apart_m = 2.0 * scene.box.size().z;
  const double voxel_m = options.spacing_m;
  const Scene near = twice(scene, {0.0, 0.0, apart_m}), far = twice(scene, {0.0, 0.0, 2.0 * apart_m + scene.box.size().z});
  const VoxelEngine near_engine(near, make_voxels(near, voxel_m).volume);
  const VoxelEngine far_engine(far, make_voxels(far, voxel_m).volume);
  // An image that contains both copies.
  const auto view_of = [&](const Scene& both) {
    Acquisition view = standard_view(both, options);
    view.azimuth_rad = 0.0;
    view.n_range = static_cast<int>(std::ceil(far.box.size().z / options.spacing_m)) + 64;
    return view;
  };
  const ViewPlan near_plan = near_engine.plan(view_of(near), {}), far_plan = far_engine.plan(view_of(far), {});
  const auto times = run_in_turn(
      {[&] { far_engine.render(far_plan); }, [&] { near_engine.render(near_plan); }}, options.rounds);
  return {{"box_volume_ratio", (far.box.size().z) / (near.box.size().z)},
          {"time_ratio", ratio_json(times[0], times[1])},
          {"memory_ratio", double(far_engine.memory_bytes()) / double(near_engine.memory_bytes())}};
}

}  // namespace

nlohmann::json study_voxel(const StudyOptions& options) {
  const ThreadLimit one_thread(1);
  nlohmann::json results = nlohmann::json::array();
  for (const NamedScene& named : load_scenes(options)) {
    const SurfaceEngine surface(named.scene);
    const Acquisition view = standard_view(named.scene, options);
    ViewPlan surface_plan = surface.plan(view, {});
    surface_plan.error.estimate = false;
    Sampling converged;
    converged.n_elevation = 8 * surface_plan.fan.n_elevation;
    converged.n_slices = 64;
    const Image<float> reference = surface.render(surface.plan(view, converged)).beta0;

    nlohmann::json sizes = nlohmann::json::array();
    double first_error = 0.0, last_error = 0.0, first_s = 0.0, last_s = 0.0, first_voxels = 0.0,
           last_voxels = 0.0;
    constexpr double kBins[] = {1.0, 0.5, 0.25, 0.125};
    for (const double bins : kBins) {
      Voxels voxels = make_voxels(named.scene, bins * options.spacing_m);
      const auto n_voxels = static_cast<double>(voxels.volume.n_occupied_voxels);
      const Volume kept = voxels.volume;
      const VoxelEngine engine(named.scene, std::move(voxels.volume));
      ViewPlan plan = engine.plan(view, {});
      plan.error.estimate = false;
      RenderedView rendered;
      const auto times = run_in_turn({[&] { rendered = engine.render(plan); },
                                      [&] { surface.render(surface_plan); }},
                                     options.rounds);
      nlohmann::json entry{{"voxel_bins", bins},
                           {"occupied_voxels", n_voxels},
                           {"voxelise_s", voxels.voxelise_s},
                           {"to_volume_s", voxels.to_volume_s},
                           {"memory_bytes", engine.memory_bytes()},
                           {"kept_rays", plan.n_kept_rays},
                           {"view_ms", times[0].median() * 1e3},
                           {"view_over_surface_view", ratio_json(times[0], times[1])},
                           {"error", relative_l2_error(rendered.beta0, reference)}};
      DenseMarch dense(kept, plan);
      const int stride = bins == 1.0 ? 8 : 32;  // a sample of the rows represents all
      const auto dense_times = run_in_turn({[&] { dense.march(stride); }}, 3);
      entry["dense_march_over_view"] = dense_times[0].median() * stride / times[0].median();
      const Volume filled = densified(kept);
      DenseMarch through_all(filled, plan);
      const auto filled_times = run_in_turn({[&] { through_all.march(stride); }}, 3);
      entry["dense_march_of_dense_voxels_over_view"] = filled_times[0].median() * stride / times[0].median();
      last_error = relative_l2_error(rendered.beta0, reference);
      last_s = voxels.voxelise_s + voxels.to_volume_s;
      last_voxels = n_voxels;
      if (bins == kBins[0]) {
        first_error = last_error;
        first_s = last_s;
        first_voxels = last_voxels;
      }
      sizes.push_back(std::move(entry));
    }
    results.push_back({{"scene", named.name},
                       {"sizes", sizes},
                       {"error_slope", std::log(first_error / last_error) / std::log(kBins[0] / kBins[3])},
                       {"voxelising_exponent", std::log(last_s / first_s) / std::log(last_voxels / first_voxels)},
                       {"empty_space_doubled", empty_space(named.scene, options)}});
  }
  return results;
}

}  // namespace sarnerf::bench
