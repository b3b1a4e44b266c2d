// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>

#include "sarnerf/mpa/segments.h"
#include "sarnerf/nerf/row_renderer.h"

namespace sarnerf {

/// A ray of a row: its place along track, its number in the grid's fan, and the part of it inside of the box.
using VisitRay = std::function<void(const RayGrid& rays, double along_track_m, int k,
                                    const RangeInterval& inside)>;

/// Calls visit() for the rays of a row that meet the box, and returns their fan. They belong to a comb that begins at
/// the aim point and is shifted by the request's jitter, so that the box decides which rays there are and not where;
/// along track they are shifted against each other by the golden ratio.
Fan for_each_ray(const RowRequest& request, const Box& box_m, const RaySampling& sampling,
                 const VisitRay& visit);

/// Pixels of rows one behind the other.
std::size_t n_pixels(std::span<const RowRequest> rows);

}  // namespace sarnerf
