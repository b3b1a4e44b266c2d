// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "field/rows.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

namespace {

/// Segments of the cache's that touch within this share of a bin are one run.
constexpr double kGap_bins = 1e-4;

/// Cuts bins [near, far) of a ray at whole numbers, and evenly where parts would be longer than `longest_bins`.
void cut(const RayGrid& rays, double along_track_m, int k, double near, double far,
         double longest_bins, RowPart& part) {
  const Acquisition& a = rays.acquisition();
  const double spacing_m = a.range_spacing_m;
  for (double bin = std::floor(near); bin < far; bin += 1.0) {
    const double begin = std::max(bin, near), end = std::min(bin + 1.0, far);
    if (end - begin < kGap_bins) continue;
    const double n_parts = std::max(1.0, std::ceil((end - begin) / longest_bins - kGap_bins));
    const double length = (end - begin) / n_parts;
    for (double n = 0.0; n < n_parts; n += 1.0) {
      const double at = begin + n * length;
      part.batch.bin.push_back(bin < 0.0 ? kNoBin : static_cast<std::uint32_t>(bin));
      part.batch.length_m.push_back(static_cast<float>(length * spacing_m));
      part.field.near_bin.push_back(at);
      const double offset_m = (at + 0.5 * length - 0.5 * a.n_range) * spacing_m;
      part.batch.point_m.emplace_back(rays.point_from_aim_m(along_track_m, offset_m, k));
    }
  }
  part.batch.ray_begin.back() = static_cast<std::uint32_t>(part.batch.n_segments());
}

}  // namespace

RowSegments::RowSegments(std::span<const RowRequest> rows, const RaySampling& sampling,
                         const DensityCache& cache, std::shared_ptr<const LevelGround> ground)
    : sampling_(sampling), ground_(std::move(ground)), n_pixels_(sarnerf::n_pixels(rows)) {
  const std::size_t n_parts =
      std::max<std::size_t>(1, std::min(rows.size(), static_cast<std::size_t>(thread_count())));
  parts_.resize(n_parts);
  for (auto& part : parts_) part = std::make_unique<RowPart>();
  parallel_for(n_parts, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t first = rows.size() * p / n_parts, last = rows.size() * (p + 1) / n_parts;
      place(rows.subspan(first, last - first), cache, *parts_[p]);
    }
  });
  ray_begin_.push_back(0);
  std::size_t pixel = 0;
  for (const auto& part : parts_) {
    const SampleBatch& batch = part->batch;
    const auto first = static_cast<std::uint32_t>(point_m_.size());
    first_segment_.push_back(first);
    first_pixel_.push_back(pixel);
    for (const RowPart::Row& row : part->rows)
      pixel += static_cast<std::size_t>(row.acquisition.n_range);
    point_m_.insert(point_m_.end(), batch.point_m.begin(), batch.point_m.end());
    ray_direction_.insert(ray_direction_.end(), batch.ray_direction.begin(),
                          batch.ray_direction.end());
    for (std::size_t q = 1; q < batch.ray_begin.size(); ++q)
      ray_begin_.push_back(first + batch.ray_begin[q]);
  }
}

RowSegments::~RowSegments() = default;

void RowSegments::place(std::span<const RowRequest> rows, const DensityCache& cache,
                        RowPart& part) const {
  Box box_m = occupied_box(cache.occupancy(), cache.transform());
  if (ground_) end_at(*ground_, box_m);
  VolumeMarcher marcher(cache.view(), DensityCache::channels(), cache.occupancy(),
                        cache.transform().voxel_size_m, sampling_.end_depth);
  SampleBatch coarse;
  BatchField coarse_field;
  for (const RowRequest& request : rows) {
    const Acquisition& a = request.acquisition;
    const double longest_bins = sampling_.longest_m / a.range_spacing_m;
    const RowRays row = rays_of_row(request, box_m, sampling_);
    coarse.clear();
    coarse_field.clear();
    marcher.march(row.grid, row.rays, coarse, coarse_field);
    part.begin_row(a, request.row);
    for (std::size_t q = 0; q < row.rays.size(); ++q) {
      const std::size_t first = coarse.ray_begin[q], end = coarse.ray_begin[q + 1];
      if (first == end) continue;
      const MarchRay& ray = row.rays[q];
      begin_ray(part.batch, row.grid, ray.row, ray.k);
      part.ray_k.push_back(static_cast<std::uint32_t>(ray.k));
      double near = coarse_field.near_bin[first], far = near;
      for (std::size_t s = first; s < end; ++s) {
        if (coarse_field.near_bin[s] > far + kGap_bins) {
          cut(row.grid, ray.along_track_m, ray.k, near, far, longest_bins, part);
          near = coarse_field.near_bin[s];
        }
        far = coarse_field.near_bin[s] + double{coarse.length_m[s]} / a.range_spacing_m;
      }
      cut(row.grid, ray.along_track_m, ray.k, near, far, longest_bins, part);
    }
    part.end_row(row.grid.fan());
  }
}

std::vector<RowSegments::Place> RowSegments::places() const {
  std::vector<Place> places;
  std::size_t number = 0;
  for (const auto& part : parts_) {
    for (const RowPart::Row& row : part->rows) {
      for (std::uint32_t s = part->first_segment(row); s < part->end_segment(row); ++s)
        places.push_back({double{part->batch.length_m[s]}, part->field.near_bin[s], number});
      ++number;
    }
  }
  return places;
}

void RowSegments::integrate(std::span<const float> extinction_per_m,
                            std::span<const float> brightness, Integrator integrator,
                            std::span<float> pixels) {
  parallel_for(parts_.size(), 1, [&](std::size_t p, std::size_t, int) {
    RowPart& part = *parts_[p];
    const auto mine = [&](std::span<const float> all) {
      return all.subspan(first_segment_[p], part.batch.n_segments());
    };
    const auto kappa = mine(extinction_per_m), gamma = mine(brightness);
    part.field.extinction_per_m.assign(kappa.begin(), kappa.end());
    part.field.source.assign(gamma.begin(), gamma.end());
    auto out = pixels.subspan(first_pixel_[p]);
    for (const RowPart::Row& row : part.rows) {
      const auto n_range = static_cast<std::size_t>(row.acquisition.n_range);
      row_pixels(part, row, samples(part.field, SourceBasis::harmonics), integrator, sampling_,
                 out.first(n_range));
      if (ground_) add_ground(part, row, *ground_, sampling_, out.first(n_range));
      out = out.subspan(n_range);
    }
  });
}

void RowSegments::adjoint(std::span<const float> pixel_gradients, Integrator integrator,
                          std::span<float> d_extinction, std::span<float> d_brightness) {
  parallel_for(parts_.size(), 1, [&](std::size_t p, std::size_t, int) {
    RowPart& part = *parts_[p];
    const std::size_t n = part.batch.n_segments();
    part.d_extinction.assign(n, 0.0f);
    part.d_source.assign(n, 0.0f);
    auto gradients = pixel_gradients.subspan(first_pixel_[p]);
    for (const RowPart::Row& row : part.rows) {
      const auto n_range = static_cast<std::size_t>(row.acquisition.n_range);
      row_pixels_adjoint(part, row, samples(part.field, SourceBasis::harmonics), integrator,
                         sampling_, gradients.first(n_range));
      if (ground_) add_ground_adjoint(part, row, *ground_, sampling_, gradients.first(n_range));
      gradients = gradients.subspan(n_range);
    }
    if (sampling_.distortion > 0.0) {
      // A ray counts as much as the part of a pixel that it stands for.
      add_distortion_gradient(part, [&](const RowPart::Row& row) {
        return sampling_.distortion * sampling_.ray_spacing_m /
               (row.acquisition.range_spacing_m * sampling_.sub_rows);
      });
    }
    std::copy(part.d_extinction.begin(), part.d_extinction.end(),
              d_extinction.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
    std::copy(part.d_source.begin(), part.d_source.end(),
              d_brightness.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
  });
}

}  // namespace sarnerf
