// SPDX-License-Identifier: Apache-2.0
#include "map_memory.h"

#include <algorithm>
#include <limits>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"
#include "sarnerf/geometry/ray_grid.h"

namespace sarnerf {
namespace {

/// A ray of a map, and what it returned in the list that says where the bottom is.
constexpr double kBytesPerRay = 12.0 + 16.0;

double rays_of(const Acquisition& view, const Box& box_m, double spacing_m) {
  const RadarFrame frame = radar_frame(view);
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const glm::dvec3& corner : box_m.corners()) {
    low_m = std::min(low_m, glm::dot(corner, frame.h));
    high_m = std::max(high_m, glm::dot(corner, frame.h));
  }
  const auto [lowest_rad, highest_rad] = angular_extent(view, box_m);
  const double n_along = (high_m - low_m) / spacing_m + 4.0;
  const double n_angles = (highest_rad - lowest_rad) * view.slant_range_m / spacing_m + 3.0;
  return n_along * n_angles;
}

}  // namespace

std::uint64_t return_map_bytes(std::span<const Acquisition> views, const Box& box_m, double spacing_m) {
  double n_rays = 0.0;
  for (const Acquisition& view : views) n_rays += rays_of(view, box_m, spacing_m);
  return static_cast<std::uint64_t>(kBytesPerRay * n_rays);
}

std::uint64_t memory_beside_maps(std::span<const Acquisition> views, const Box& box_m, double spacing_m,
                                 std::uint64_t max_memory_bytes) {
  if (max_memory_bytes == 0) return 0;
  const std::uint64_t needed = return_map_bytes(views, box_m, spacing_m);
  if (needed < max_memory_bytes) return max_memory_bytes - needed;
  throw UsageError(format("about %.3g MiB are needed for what %zu views see, more than --max-memory allows (%.3g MiB left); "
                          "--shell needs none of it",
                          static_cast<double>(needed) / 1048576.0, views.size(),
                          static_cast<double>(max_memory_bytes) / 1048576.0));
}

}  // namespace sarnerf
