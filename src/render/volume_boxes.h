// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/field/occupancy.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// The occupied part of each of a volume's bricks of cells, as boxes in world coordinates.
std::vector<Box> volume_boxes_m(const Occupancy& occupancy, const GridTransform& transform);

}  // namespace sarnerf
