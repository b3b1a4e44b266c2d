// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/carved_solid.h"

#include "carved_occupancy.h"
#include "level_surface.h"

namespace sarnerf {

SurfaceMesh carved_solid(std::span<const PosedImage> images, const CarvingLattice& lattice,
                         std::optional<double> ground_height_m, const Monitor& monitor) {
  return level_surface(*carved_occupancy(images, lattice, ground_height_m, monitor));
}

}  // namespace sarnerf
