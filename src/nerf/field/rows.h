// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/nerf/ground.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// The rows that one thread renders, and its memory.
struct RowPart {
  AzimuthRows rows;
  std::vector<double> of_bin;                 ///< contributions to a row's bins, or derivatives by them
  std::vector<float> d_extinction, d_source;  ///< gradients of all segments
  std::vector<float> d_bounce, d_bounce_extinction;  ///< those of Path::by_ground
  std::vector<float> d_values;                ///< gradients of the grid's values, one copy per thread
};

/// Calls f(part, first row, end row) for each part, in parallel. Parts depend on the numbers of rows and parts only, so that
/// results do not depend on timing.
template <class F>
void for_each_part(std::size_t n_rows, std::size_t n_parts, F&& f) {
  parallel_for(n_parts, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t p = begin; p < end; ++p) f(p, n_rows * p / n_parts, n_rows * (p + 1) / n_parts);
  });
}
/// The number of threads, or of rows if these are fewer; at least 1.
std::size_t n_row_parts(std::size_t n_rows);

/// β⁰ of a part's rows, concatenated, from the field at their segments, plus the attenuated power of the ground, if there
/// is one.
void render_part(RowPart& part, SourceBasis basis, Integrator integrator, const RaySampling& sampling,
                 const LevelGround* ground, std::span<float> pixels);

/// Adjoint of render_part(): from ∂L/∂pixel writes part.d_extinction and part.d_source.
void render_part_adjoint(RowPart& part, SourceBasis basis, Integrator integrator, const RaySampling& sampling,
                         const LevelGround* ground, std::span<const float> pixel_gradients);

/// Cuts a box off at the ground, so that rays through it end there.
inline void end_at(const LevelGround& ground, Box& box_m) {
  if (!box_m.empty()) box_m.min.y = std::max(box_m.min.y, ground.height_m);
}

}  // namespace sarnerf
