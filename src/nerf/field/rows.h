// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/nerf/ground.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// The segments of some azimuth rows that one thread renders, one row behind the other, and its memory.
struct RowPart {
  struct Row {
    Acquisition acquisition;
    int row;
    Fan fan;
    std::size_t first_ray, end_ray;
  };
  SampleBatch batch;
  BatchField field;
  std::vector<Row> rows;
  std::vector<std::uint32_t> ray_k;  ///< of all rays: their places in the fans

  std::vector<double> of_pixel;               ///< a row's pixels, or their gradients
  std::vector<float> d_extinction, d_source;  ///< gradients of all segments
  std::vector<float> d_values;                ///< of the grid's values, where several threads add to them

  void clear() {
    batch.clear();
    field.clear();
    rows.clear();
    ray_k.clear();
  }
  /// What is appended to the batch in between are the rays of one row.
  void begin_row(const Acquisition& acquisition, int row) {
    rows.push_back({acquisition, row, {}, batch.n_rays(), batch.n_rays()});
  }
  void end_row(const Fan& fan) {
    Row& row = rows.back();
    row.fan = fan;
    row.end_ray = batch.n_rays();
  }

  std::uint32_t first_segment(const Row& row) const { return batch.ray_begin[row.first_ray]; }
  std::uint32_t end_segment(const Row& row) const { return batch.ray_begin[row.end_ray]; }

  /// Rays and segments of a row, as the integrators take them: ray_begin counts from the batch's first segment.
  SegmentSpans<float> segments(const Row& row) const {
    SegmentSpans<float> s = spans(batch);
    s.ray_begin = s.ray_begin.subspan(row.first_ray, row.end_ray - row.first_ray + 1);
    s.ray_row = s.ray_row.subspan(row.first_ray, row.end_ray - row.first_ray);
    return s;
  }
};

/// Rays through a box end where they meet the ground.
inline void end_at(const LevelGround& ground, Box& box_m) {
  if (!box_m.empty()) box_m.min.y = std::max(box_m.min.y, ground.height_m);
}

/// Adds to a row's pixels what its rays leave of the ground's image: S_j = T at the angle under which bin j sees the
/// ground, linear between the rays of the fan, of three places in the bin. Rays that were not made, since they miss all
/// matter, have T = 1.
void add_ground(const RowPart& part, const RowPart::Row& row, const LevelGround& ground, const RaySampling& sampling,
                std::span<float> pixels);

/// Its adjoint: adds ∂L/∂κ of the row's segments, from ∂L/∂pixel, to part.d_extinction.
void add_ground_adjoint(RowPart& part, const RowPart::Row& row, const LevelGround& ground, const RaySampling& sampling,
                        std::span<const float> pixel_gradients);

/// β⁰ of one of the part's rows from the field's values at its segments: emission and absorption along rays
/// (mpa::integrate), times r_j Δθ / Δr.
/// `pixels` [n_range].
void row_pixels(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                Integrator integrator, const RaySampling& sampling, std::span<float> pixels);

/// Its adjoint: writes the row's share of part.d_extinction and part.d_source, arrays over all segments.
void row_pixels_adjoint(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                        Integrator integrator, const RaySampling& sampling,
                        std::span<const float> pixel_gradients);

/// The rays of a row that meet a box, each with the part of it inside.
struct RowRays {
  RayGrid grid;
  std::vector<MarchRay> rays;
};

/// They belong to a comb that begins at the aim point and is shifted by the request's jitter, so that the box decides
/// which rays there are and not where; along track they are shifted against each other by the golden ratio.
RowRays rays_of_row(const RowRequest& request, const Box& box_m, const RaySampling& sampling);

/// Pixels of rows one behind the other.
std::size_t n_pixels(std::span<const RowRequest> rows);

/// Adds the gradient of Σ_rays weight(row) D to the gradients of the segments' extinctions. With w_s = T_s (1 − e^−x_s)
/// the share of a ray's power that segment s could return, at range bins r_s and of length ℓ_s bins,
///
///     D = Σ_s Σ_t w_s w_t |r_s − r_t| + ⅓ Σ_s w_s² ℓ_s
///
/// is least when a ray returns all it returns from one place: fog becomes surface. From Barron et al., Mip-NeRF 360
/// (2022), eq. 15, with ranges in bins instead of normalised distances. Linear in segments.
void add_distortion_gradient(RowPart& part, const std::function<double(const RowPart::Row&)>& weight);

}  // namespace sarnerf
