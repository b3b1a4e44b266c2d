// SPDX-License-Identifier: Apache-2.0
#include "packed_row.h"

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

}  // namespace sarnerf
