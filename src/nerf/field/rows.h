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
  std::vector<double> of_bin;                 ///< of a row: contributions, or derivatives by them
  std::vector<float> d_extinction, d_source;  ///< gradients of all segments
  std::vector<float> d_values;                ///< of the grid's values, where several threads add to them
};

/// Calls f(part, first row, end row) for the parts of rows that threads take: always the same for the same number of threads,
/// so that results do not depend on timing.
template <class F>
void for_each_part(std::size_t n_rows, std::size_t n_parts, F&& f) {
  parallel_for(n_parts, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t p = begin; p < end; ++p) f(p, n_rows * p / n_parts, n_rows * (p + 1) / n_parts);
  });
}
/// As many as there are threads, or rows if these are fewer; one at least.
std::size_t n_row_parts(std::size_t n_rows);

/// β⁰ of a part's rows one behind the other, from the field at their segments, with what the rays leave of the ground, if
/// there is one.
void render_part(RowPart& part, SourceBasis basis, Integrator integrator, const RaySampling& sampling,
                 const LevelGround* ground, std::span<float> pixels);

/// Its adjoint: from ∂L/∂pixel writes part.d_extinction and part.d_source.
void render_part_adjoint(RowPart& part, SourceBasis basis, Integrator integrator, const RaySampling& sampling,
                         const LevelGround* ground, std::span<const float> pixel_gradients);

/// Rays through a box end where they meet the ground.
inline void end_at(const LevelGround& ground, Box& box_m) {
  if (!box_m.empty()) box_m.min.y = std::max(box_m.min.y, ground.height_m);
}

}  // namespace sarnerf
