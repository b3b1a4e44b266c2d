// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/trace/ray_tracer.h"
#include "view_rays.h"
#include "visible_extent.h"

namespace sarnerf {

/// The rays of one slice that may meet matter, side by side for tracing, and what they met.
struct PackedRow {
  std::vector<float> origin_x, origin_y, origin_z, direction_x, direction_y, direction_z;
  std::vector<float> distance, normal_x, normal_y, normal_z;
  std::vector<std::uint32_t> box;

  /// Takes the rays of these ranges of k, in their order, at an along-track coordinate.
  void pack(const ViewRays& rays, double along_m, std::span<const RayRange> ranges);

  RayRow rays(float far_m) const {
    return {origin_x, origin_y, origin_z, direction_x, direction_y, direction_z, far_m};
  }
  HitRow hits() { return {distance, normal_x, normal_y, normal_z, box}; }
};

}  // namespace sarnerf
