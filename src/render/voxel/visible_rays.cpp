// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "voxel/voxel_view.h"
#include "sarnerf/mpa/deposit.h"

namespace sarnerf {

void PackedRow::pack(const ViewRays& view, double along_m, std::span<const RayRange> ranges) {
  std::size_t n_rays = 0;
  for (const RayRange& range : ranges) n_rays += static_cast<std::size_t>(range.count);
  for (auto* array : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z,
                      &distance, &normal_x, &normal_y, &normal_z}) {
    array->resize(n_rays);
  }
  box.resize(n_rays);
  const glm::dvec3 shift = along_m * view.grid.frame().h;
  std::size_t n = 0;
  for (const RayRange& range : ranges) {
    for (int k = range.first; k < range.first + range.count; ++k, ++n) {
      const auto m = static_cast<std::size_t>(k);
      origin_x[n] = static_cast<float>(view.origin_x[m] + shift.x);
      origin_y[n] = static_cast<float>(view.origin_y[m] + shift.y);
      origin_z[n] = static_cast<float>(view.origin_z[m] + shift.z);
      direction_x[n] = view.direction_x[m];
      direction_y[n] = view.direction_y[m];
      direction_z[n] = view.direction_z[m];
    }
  }
}

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
    // Depth is at most range: a box deeper than the last bin lies beyond it.
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
      // Merging whenever the vector is full keeps its size close to that of the merged result.
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

GroundRays::GroundRays(const ViewRays& rays, const Appearance& appearance, double height_m)
    : rays_(rays), appearance_(appearance) {
  const Acquisition& a = rays.grid.acquisition();
  const Fan& fan = rays.grid.fan();
  const auto offset_at = [&](double delta) { return plane_range_offset_m(a, height_m - a.aim_m.y, delta); };
  for (int k = 0; k < fan.n_elevation; ++k) {
    const double delta = fan.ray_angle_rad(k);
    const double offset_m = offset_at(delta);
    const double cosine = std::max(0.0, std::cos(a.incidence_rad + delta));
    offset_m_.push_back(offset_m);
    gamma_.push_back(double(appearance.brightness(static_cast<float>(cosine))));
    first_bin_.push_back(rays.bin_coordinate(offset_at(fan.ray_angle_rad(k - 0.5))));
    last_bin_.push_back(rays.bin_coordinate(offset_at(fan.ray_angle_rad(k + 0.5))));
  }
}

void GroundRays::deposit(int k, double along_track_m, double weight, std::span<double> bins) const {
  const auto n = static_cast<std::size_t>(k);
  if (!std::isfinite(offset_m_[n]) || !std::isfinite(first_bin_[n]) || !std::isfinite(last_bin_[n])) return;
  double mass = weight * gamma_[n];
  if (appearance_.checker) {
    mass *= double(appearance_.checker->factor(
        glm::vec3(rays_.scene_point(along_track_m, offset_m_[n], k))));
  }
  deposit_trapezoid(bins, first_bin_[n], last_bin_[n], 0.0, mass);
}

}  // namespace sarnerf
