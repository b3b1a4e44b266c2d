// SPDX-License-Identifier: Apache-2.0
#include "view_rays.h"

#include <algorithm>
#include <cmath>

namespace sarnerf {

ViewRays::ViewRays(const Acquisition& acquisition, const Fan& fan, const glm::dvec3& scene_origin_m,
                   std::pair<double, double> range_offsets_m)
    : grid(acquisition, fan) {
  // A margin keeps origins outside of faces that coincide with the box; a floor keeps them in front of
  // the radar.
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

}  // namespace sarnerf
