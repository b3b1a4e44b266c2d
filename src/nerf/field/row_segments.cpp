// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "field/rows.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

RowSegments::RowSegments(std::span<const RowRequest> rows, const RaySampling& sampling,
                         const OccupancyGrid& cache, std::shared_ptr<const LevelGround> ground)
    : sampling_(sampling), ground_(std::move(ground)), n_pixels_(sarnerf::n_pixels(rows)) {
  parts_.resize(n_row_parts(rows.size()));
  for (auto& part : parts_) part = std::make_unique<RowPart>();
  for_each_part(rows.size(), parts_.size(), [&](std::size_t p, std::size_t first, std::size_t end) {
    place(rows.subspan(first, end - first), cache, *parts_[p]);
  });
  ray_begin_.push_back(0);
  std::size_t pixel = 0;
  for (const auto& part : parts_) {
    const SampleBatch& batch = part->rows.batch();
    const auto first = static_cast<std::uint32_t>(point_m_.size());
    first_segment_.push_back(first);
    first_pixel_.push_back(pixel);
    pixel += part->rows.n_pixels();
    point_m_.insert(point_m_.end(), batch.point_m.begin(), batch.point_m.end());
    ray_direction_.insert(ray_direction_.end(), batch.ray_direction.begin(),
                          batch.ray_direction.end());
    for (std::size_t q = 1; q < batch.ray_begin.size(); ++q)
      ray_begin_.push_back(first + batch.ray_begin[q]);
  }
}

RowSegments::~RowSegments() = default;

void RowSegments::place(std::span<const RowRequest> rows, const OccupancyGrid& cache,
                        RowPart& part) const {
  Box box_m = occupied_box(cache.occupancy(), cache.transform());
  if (ground_) end_at(*ground_, box_m);
  VolumeMarcher marcher(cache.view(), OccupancyGrid::channels(), cache.occupancy(),
                        cache.transform().voxel_size_m, sampling_.end_depth);
  for (const RowRequest& request : rows) {
    const RowRays row = rays_of_row(request, box_m, sampling_);
    part.rows.begin_row(row.grid, request.row, sampling_.sub_rows);
    part.rows.cut(marcher, row.grid, row.rays, sampling_.longest_m);
  }
}

std::vector<RowSegments::Place> RowSegments::places() const {
  std::vector<Place> places;
  std::size_t number = 0;
  for (const auto& part : parts_) {
    const AzimuthRows& rows = part->rows;
    for (const AzimuthRows::Row& row : rows.rows()) {
      for (std::uint32_t s = rows.first_segment(row); s < rows.end_segment(row); ++s)
        places.push_back({double{rows.batch().length_m[s]}, rows.field().near_bin[s], number});
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
      return all.subspan(first_segment_[p], part.rows.n_segments());
    };
    part.rows.set_field(mine(extinction_per_m), mine(brightness));
    render_part(part, SourceBasis::harmonics, integrator, sampling_, ground_.get(), pixels.subspan(first_pixel_[p]));
  });
}

void RowSegments::adjoint(std::span<const float> pixel_gradients, Integrator integrator, std::span<float> d_extinction,
                          std::span<float> d_brightness) {
  parallel_for(parts_.size(), 1, [&](std::size_t p, std::size_t, int) {
    RowPart& part = *parts_[p];
    render_part_adjoint(part, SourceBasis::harmonics, integrator, sampling_, ground_.get(),
                        pixel_gradients.subspan(first_pixel_[p]));
    std::copy(part.d_extinction.begin(), part.d_extinction.end(),
              d_extinction.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
    std::copy(part.d_source.begin(), part.d_source.end(),
              d_brightness.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
  });
}

}  // namespace sarnerf
