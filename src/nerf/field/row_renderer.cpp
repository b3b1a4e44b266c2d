// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/row_renderer.h"

#include <algorithm>
#include <limits>
#include <string>

#include "field/rows.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {

struct RowMemory {
  std::vector<std::unique_ptr<RowPart>> parts;
};

RowRenderer::RowRenderer(const BrickView<const float>& values, const FieldChannels& channels,
                         const Occupancy& occupancy, const RaySampling& sampling,
                         std::shared_ptr<RowMemory> memory, const LevelGround* ground)
    : values_(values),
      channels_(channels),
      occupancy_(&occupancy),
      sampling_(sampling),
      box_m_(occupied_box(occupancy, values.transform)),
      ground_(ground),
      memory_(memory ? std::move(memory) : std::make_shared<RowMemory>()) {
  if (ground_ != nullptr) end_at(*ground_, box_m_);
}

RowRenderer::~RowRenderer() = default;
RowRenderer::RowRenderer(RowRenderer&&) noexcept = default;
RowRenderer& RowRenderer::operator=(RowRenderer&&) noexcept = default;

void RowRenderer::forward_part(std::span<const RowRequest> rows, std::span<float> pixels, RowPart& part) const {
  part.rows.clear();
  VolumeMarcher marcher(values_, channels_, *occupancy_, sampling_.longest_m, sampling_.end_depth);
  for (const RowRequest& request : rows) {
    const RowRays row = rays_of_row(request, box_m_, sampling_);
    part.rows.begin_row(row.grid, request.row, sampling_.sub_rows);
    part.rows.march(marcher, row.grid, row.rays);
  }
  render_part(part, channels_.basis, Integrator::exact, sampling_, ground_, pixels);
}

void RowRenderer::forward(std::span<const RowRequest> rows, std::span<float> pixels) {
  if (pixels.size() != n_pixels(rows))
    throw UsageError("the rows have " + std::to_string(n_pixels(rows)) + " pixels, not " +
                     std::to_string(pixels.size()));
  auto& parts = memory_->parts;
  parts.resize(n_row_parts(rows.size()));
  for (auto& part : parts)
    if (!part) part = std::make_unique<RowPart>();
  for_each_part(rows.size(), parts.size(), [&](std::size_t p, std::size_t first, std::size_t end) {
    const auto mine = rows.subspan(first, end - first);
    forward_part(mine, pixels.subspan(n_pixels(rows.first(first)), n_pixels(mine)), *parts[p]);
  });
}

void RowRenderer::backward_part(std::span<const float> pixel_gradients, RowPart& part) const {
  render_part_adjoint(part, channels_.basis, Integrator::exact, sampling_, ground_, pixel_gradients);
  sample_field_adjoint({values_.topology, values_.transform, values_.n_channels, part.d_values}, channels_,
                       part.rows.batch().point_m, {part.rows.batch().ray_begin, part.rows.batch().ray_direction},
                       part.rows.field().source,
                       {part.d_extinction, {}, part.d_source});
}

void RowRenderer::backward(std::span<const float> pixel_gradients, std::span<const std::uint32_t> active,
                           std::span<float> value_gradients) {
  const auto n_channels = static_cast<std::size_t>(values_.n_channels);
  if (value_gradients.size() != active.size() * n_channels)
    throw UsageError("gradients must be as many as the values of the active voxels");
  const auto& parts = memory_->parts;
  std::vector<std::size_t> first_pixel{0};
  for (const auto& part : parts) first_pixel.push_back(first_pixel.back() + part->rows.n_pixels());
  if (pixel_gradients.size() != first_pixel.back())
    throw UsageError("gradients must be as many as the pixels of the last forward pass");

  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t p = begin; p < end; ++p) {
      RowPart& part = *parts[p];
      if (part.d_values.size() != values_.values.size()) part.d_values.assign(values_.values.size(), 0.0f);
      const auto mine = pixel_gradients.subspan(first_pixel[p], first_pixel[p + 1] - first_pixel[p]);
      backward_part(mine, part);
    }
  });
  // Only active voxels are summed and cleared. The sums of inactive ones are never read.
  constexpr std::size_t kGrain = 1 << 12;
  parallel_for(active.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      float* const sum = &value_gradients[n * n_channels];
      std::fill_n(sum, n_channels, 0.0f);
      for (const auto& part : parts) {
        float* const mine = &part->d_values[active[n] * n_channels];
        for (std::size_t c = 0; c < n_channels; ++c) {
          sum[c] += mine[c];
          mine[c] = 0.0f;
        }
      }
    }
  });
}

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
                            std::span<float> pixels, std::span<const float> bounce) {
  parallel_for(parts_.size(), 1, [&](std::size_t p, std::size_t, int) {
    RowPart& part = *parts_[p];
    const auto mine = [&](std::span<const float> all) {
      return all.subspan(first_segment_[p], part.rows.n_segments());
    };
    part.rows.set_field(mine(extinction_per_m), mine(brightness));
    if (!bounce.empty()) part.rows.set_bounce(mine(bounce), ground_->height_m);
    render_part(part, SourceBasis::harmonics, integrator, sampling_, ground_.get(), pixels.subspan(first_pixel_[p]));
  });
}

void RowSegments::adjoint(std::span<const float> pixel_gradients, Integrator integrator, std::span<float> d_extinction,
                          std::span<float> d_brightness, std::span<float> d_bounce) {
  parallel_for(parts_.size(), 1, [&](std::size_t p, std::size_t, int) {
    RowPart& part = *parts_[p];
    render_part_adjoint(part, SourceBasis::harmonics, integrator, sampling_, ground_.get(),
                        pixel_gradients.subspan(first_pixel_[p]));
    std::copy(part.d_extinction.begin(), part.d_extinction.end(),
              d_extinction.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
    std::copy(part.d_source.begin(), part.d_source.end(),
              d_brightness.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
    if (!d_bounce.empty())
      std::copy(part.d_bounce.begin(), part.d_bounce.end(), d_bounce.begin() + static_cast<std::ptrdiff_t>(first_segment_[p]));
  });
}

Box occupied_box(const Occupancy& occupancy, const GridTransform& transform) {
  Box box;
  const BrickTopology& bricks = occupancy.bricks();
  for (std::uint32_t brick = 0; brick < bricks.n_bricks(); ++brick) {
    const auto cells = occupancy.cell_box(brick);
    const glm::ivec3 origin = bricks.coordinate(brick) * kBrickSide;
    box.include(transform.world_from_index(glm::dvec3(origin + cells.first)));
    box.include(transform.world_from_index(glm::dvec3(origin + cells.last + 1)));
  }
  return box;
}

}  // namespace sarnerf
