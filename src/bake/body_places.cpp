// SPDX-License-Identifier: Apache-2.0
#include "body_places.h"

namespace sarnerf {

BodyPlaces::BodyPlaces(const openvdb::FloatGrid& occupancy, const GridTransform& to_volume, double step_m)
    : step_m_(step_m) {
  const openvdb::CoordBBox box = occupancy.evalActiveVoxelBoundingBox();
  const auto centre_m = [&](const openvdb::Coord& c) {
    return to_volume.world_from_index(glm::dvec3(c.x(), c.y(), c.z()));
  };
  // Layer 0 is the margin, layer 1 half a step above the lowest voxel.
  first_m_ = centre_m(box.min()) - 0.5 * step_m;
  size_ = glm::ivec3(glm::ceil((centre_m(box.max()) - first_m_) / step_m)) + 2;
  full_.assign(index({size_.x - 1, size_.y - 1, size_.z - 1}) + 1, 0);
  parallel_for(static_cast<std::size_t>(size_.x), 1, [&](std::size_t begin, std::size_t end, int) {
    const openvdb::FloatGrid::ConstAccessor values = occupancy.getConstAccessor();
    for (int x = static_cast<int>(begin); x < static_cast<int>(end); ++x)
      for (int y = 0; y < size_.y; ++y)
        for (int z = 0; z < size_.z; ++z) {
          const glm::ivec3 v(glm::round(to_volume.index_from_world(point_m({x, y, z}))));
          full_[index({x, y, z})] = values.getValue({v.x, v.y, v.z}) >= 0.5f ? 1 : 0;
        }
  });
}

}  // namespace sarnerf
