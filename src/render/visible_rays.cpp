// SPDX-License-Identifier: Apache-2.0
#include "visible_rays.h"

#include <algorithm>
#include <cmath>

namespace sarnerf {
namespace {

constexpr std::size_t kLeastToMerge = 64;

/// Sorts ranges and joins those that touch.
void merge(std::vector<RayRange>& row) {
  std::sort(row.begin(), row.end(),
            [](const RayRange& a, const RayRange& b) { return a.first < b.first; });
  std::size_t n = 0;
  for (const RayRange& next : row) {
    if (n > 0 && next.first <= row[n - 1].first + row[n - 1].count) {
      const int end = std::max(row[n - 1].first + row[n - 1].count, next.first + next.count);
      row[n - 1].count = end - row[n - 1].first;
    } else {
      row[n++] = next;
    }
  }
  row.resize(n);
}

}  // namespace

VisibleRays::VisibleRays(const Acquisition& acquisition, const Fan& fan,
                         std::span<const Box> boxes_from_aim)
    : rows_(static_cast<std::size_t>(acquisition.n_azimuth)) {
  const RadarFrame frame = radar_frame(acquisition);
  const double r = acquisition.slant_range_m;
  for (const Box& box : boxes_from_aim) {
    double first_along = std::numeric_limits<double>::infinity(), last_along = -first_along;
    double first_tangent = first_along, last_tangent = -first_along, nearest = first_along;
    for (const glm::dvec3& corner : box.corners()) {
      const double along = glm::dot(corner, frame.h), depth = r + glm::dot(corner, frame.k);
      const double tangent = glm::dot(corner, frame.v) / depth;
      first_along = std::min(first_along, along);
      last_along = std::max(last_along, along);
      first_tangent = std::min(first_tangent, tangent);
      last_tangent = std::max(last_tangent, tangent);
      nearest = std::min(nearest, depth);
    }
    // Depth is at most range: what lies deeper than the last bin is not seen.
    if (nearest > acquisition.range_m(acquisition.n_range - 0.5)) continue;
    const RayRange rays =
        rays_inside(fan, std::pair{std::atan(first_tangent), std::atan(last_tangent)});
    if (rays.count == 0) continue;
    // Row i covers [a_i − Δa/2, a_i + Δa/2).
    const double middle = 0.5 * (acquisition.n_azimuth - 1);
    const double first_row = std::floor(first_along / acquisition.azimuth_spacing_m + middle + 0.5);
    const double last_row = std::floor(last_along / acquisition.azimuth_spacing_m + middle + 0.5);
    const double end = double(acquisition.n_azimuth) - 1.0;
    for (double i = std::max(first_row, 0.0); i <= std::min(last_row, end); i += 1.0) {
      std::vector<RayRange>& row = rows_[static_cast<std::size_t>(i)];
      // Merging before the vector would grow keeps it as small as its result.
      if (row.size() == row.capacity() && row.size() >= kLeastToMerge) {
        merge(row);
        row.reserve(2 * std::max(row.size(), kLeastToMerge));
      }
      row.push_back(rays);
    }
  }
  for (std::vector<RayRange>& row : rows_) {
    merge(row);
    row.shrink_to_fit();
  }
}

std::uint64_t VisibleRays::n_rays() const {
  std::uint64_t n = 0;
  for (const auto& row : rows_) {
    for (const RayRange& rays : row) n += static_cast<std::uint64_t>(rays.count);
  }
  return n;
}

}  // namespace sarnerf
