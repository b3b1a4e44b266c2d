// SPDX-License-Identifier: Apache-2.0
#include "kept_rays.h"

#include <algorithm>
#include <numeric>

#include "visible_extent.h"

namespace sarnerf::bench {
namespace {

TriangleSubset whole_mesh(const Scene& scene) {
  std::vector<std::uint32_t> all(scene.mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  return take_triangles(scene.mesh, all, scene.box.centre());
}

}  // namespace

KeptRays::KeptRays(const Scene& scene, const ViewPlan& plan)
    : mesh_(whole_mesh(scene)),
      tracer_(vertices(mesh_.vertices_m), mesh_.triangles),
      rays_(plan.acquisition, plan.fan, scene.box.centre(),
            VisibleExtent(plan.acquisition, scene.box).range_offsets_m()) {
  const VisibleExtent extent(plan.acquisition, scene.box);
  const Acquisition& a = plan.acquisition;
  const double width_m = a.azimuth_spacing_m / plan.n_sub_rows;
  constexpr int kBlock = static_cast<int>(RayTracer::kRowsPerBlock);
  for (int i = 0; i < a.n_azimuth; ++i) {
    for (int sub = 0; sub < plan.n_sub_rows; sub += kBlock) {
      const int n_slices = std::min(kBlock, plan.n_sub_rows - sub);
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

}  // namespace sarnerf::bench
