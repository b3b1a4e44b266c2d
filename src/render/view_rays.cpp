// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "plan.h"

namespace sarnerf {

ViewRays::ViewRays(const Acquisition& acquisition, const Fan& fan, const glm::dvec3& scene_origin_m,
                   std::pair<double, double> range_offsets_m)
    : grid(acquisition, fan) {
  // The margin keeps ray origins outside of faces that coincide with the box; the lower limit keeps them from
  // lying behind the radar.
  const double depth = range_offsets_m.second - range_offsets_m.first;
  const double margin = 1e-3 * depth + 1e-3 * acquisition.range_spacing_m;
  start_offset_m = std::max(range_offsets_m.first - margin, -acquisition.slant_range_m);
  far_m = static_cast<float>(range_offsets_m.second + margin - start_offset_m);

  const auto n = static_cast<std::size_t>(fan.n_elevation);
  for (auto* array : {&origin_x, &origin_y, &origin_z}) array->reserve(n);
  for (auto* array : {&direction_x, &direction_y, &direction_z, &turn_x, &turn_y, &turn_z}) {
    array->reserve(n);
  }
  const RadarFrame& frame = grid.frame();
  const glm::dvec3 aim_in_scene = acquisition.aim_m - scene_origin_m;
  for (int k = 0; k < fan.n_elevation; ++k) {
    const glm::dvec3 d = grid.direction(k);
    const glm::dvec3 origin = aim_in_scene + grid.offset_m(k) + start_offset_m * d;
    const double angle = fan.ray_angle_rad(k);
    const glm::dvec3 turn = std::cos(angle) * frame.v - std::sin(angle) * frame.k;
    origin_x.push_back(origin.x);
    origin_y.push_back(origin.y);
    origin_z.push_back(origin.z);
    direction_x.push_back(static_cast<float>(d.x));
    direction_y.push_back(static_cast<float>(d.y));
    direction_z.push_back(static_cast<float>(d.z));
    turn_x.push_back(static_cast<float>(turn.x));
    turn_y.push_back(static_cast<float>(turn.y));
    turn_z.push_back(static_cast<float>(turn.z));
  }
}

namespace {

/// Points whose convex hull is the part of a convex body between two parallel planes, given points whose hull
/// is the body. Every edge of the body is among the pairs; superfluous inner points do no harm.
template <class Points>
std::vector<glm::dvec3> clip_convex(const Points& points, int axis, double low, double high) {
  std::vector<glm::dvec3> kept;
  for (std::size_t m = 0; m < points.size(); ++m) {
    const glm::dvec3& p = points[m];
    if (p[axis] >= low && p[axis] <= high) kept.push_back(p);
    for (std::size_t n = 0; n < m; ++n) {
      const glm::dvec3& q = points[n];
      for (const double plane : {low, high}) {
        if ((p[axis] < plane) == (q[axis] < plane)) continue;
        glm::dvec3 crossing = p + (q - p) * ((plane - p[axis]) / (q[axis] - p[axis]));
        crossing[axis] = plane;
        kept.push_back(crossing);
      }
    }
  }
  return kept;
}

}  // namespace

VisibleExtent::VisibleExtent(const Acquisition& acquisition, const Box& box)
    : acquisition_(acquisition) {
  const RadarFrame frame = radar_frame(acquisition);
  const double r = acquisition.slant_range_m;
  corner_min_ = glm::dvec3(std::numeric_limits<double>::infinity());
  corner_max_ = -corner_min_;
  double largest_sagitta_m = 0.0;
  const auto world = box.corners();
  for (std::size_t n = 0; n < world.size(); ++n) {
    const glm::dvec3 q = world[n] - acquisition.aim_m;
    corners_[n] = {glm::dot(q, frame.h), glm::dot(q, frame.v), glm::dot(q, frame.k)};
    corner_min_ = glm::min(corner_min_, corners_[n]);
    corner_max_ = glm::max(corner_max_, corners_[n]);
    const double v = corners_[n].y, depth = r + corners_[n].z;
    const double range = std::hypot(depth, v);
    largest_sagitta_m = std::max(largest_sagitta_m, range + depth > 0.0 ? v * v / (range + depth) : range);
  }
  // Range lies between depth and depth + sagitta for every point of the box.
  range_offsets_m_ = {corner_min_.z, corner_max_.z + largest_sagitta_m};
  last_depth_m_ = acquisition.bin_offset_m(acquisition.n_range - 0.5);
}

std::optional<std::pair<double, double>> VisibleExtent::angles(double first_along_m,
                                                               double last_along_m) const {
  if (last_along_m < corner_min_.x || first_along_m > corner_max_.x) return std::nullopt;
  std::vector<glm::dvec3> points = clip_convex(corners_, 0, first_along_m, last_along_m);
  if (corner_max_.z > last_depth_m_) {
    points = clip_convex(points, 2, -std::numeric_limits<double>::max(), last_depth_m_);
  }
  if (points.empty()) return std::nullopt;
  // Angles are ordered like their tangents, because everything lies in front of the radar.
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const glm::dvec3& p : points) {
    const double tangent = p.y / (acquisition_.slant_range_m + p.z);
    first = std::min(first, tangent);
    last = std::max(last, tangent);
  }
  return std::pair{std::atan(first), std::atan(last)};
}

RayRange rays_inside(const Fan& fan, const std::optional<std::pair<double, double>>& angles) {
  if (!angles) return {};
  const double first = std::floor((angles->first - fan.first_angle_rad) / fan.step_rad - 0.5);
  const double last = std::ceil((angles->second - fan.first_angle_rad) / fan.step_rad - 0.5);
  const int begin = static_cast<int>(std::clamp(first, 0.0, double(fan.n_elevation)));
  const int end = static_cast<int>(std::clamp(last + 1.0, 0.0, double(fan.n_elevation)));
  return {begin, std::max(0, end - begin)};
}

}  // namespace sarnerf
