// SPDX-License-Identifier: Apache-2.0
#include "volume_boxes.h"

namespace sarnerf {

std::vector<Box> volume_boxes_m(const Occupancy& occupancy, const GridTransform& transform) {
  std::vector<Box> boxes;
  boxes.reserve(occupancy.bricks().n_bricks());
  for (std::uint32_t brick = 0; brick < occupancy.bricks().n_bricks(); ++brick) {
    const Occupancy::CellBox cells = occupancy.cell_box(brick);
    const glm::ivec3 origin = occupancy.bricks().coordinate(brick) * kBrickSide;
    Box box;
    box.include(transform.world_from_index(glm::dvec3(origin + cells.first)));
    box.include(transform.world_from_index(glm::dvec3(origin + cells.last + 1)));
    boxes.push_back(box);
  }
  return boxes;
}

}  // namespace sarnerf
