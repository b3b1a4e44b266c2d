// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/mpa/volume_march.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

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

}  // namespace sarnerf
