// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/brick_grid.h"

#include <cmath>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"

namespace sarnerf {
namespace {

template <class T>
void validate_view(const BrickView<const T>& grid) {
  if (!grid.topology) throw UsageError("a view of a grid needs a topology");
  if (grid.n_channels < 1) {
    throw UsageError("a grid needs at least 1 channel, found " + std::to_string(grid.n_channels));
  }
  if (!(grid.transform.voxel_size_m > 0.0) || !std::isfinite(grid.transform.voxel_size_m)) {
    throw UsageError("a grid's voxel size must be positive, found " +
                     format("%.6g m", grid.transform.voxel_size_m));
  }
  const std::size_t expected =
      grid.topology->n_bricks() * kBrickVoxels * static_cast<std::size_t>(grid.n_channels);
  if (grid.values.size() != expected) {
    throw UsageError("a grid of " + std::to_string(grid.topology->n_bricks()) +
                     " bricks of 512 voxels and " + std::to_string(grid.n_channels) +
                     " channels needs " + std::to_string(expected) + " values, found " +
                     std::to_string(grid.values.size()));
  }
}

}  // namespace

void validate(const BrickView<const float>& grid) { validate_view(grid); }
void validate(const BrickView<const double>& grid) { validate_view(grid); }

}  // namespace sarnerf
