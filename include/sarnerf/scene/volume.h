// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/geometry/box.h"
#include "sarnerf/scene/component.h"

namespace sarnerf {

/// A scene as sparse voxels, in the form that renderers sample: bricks with all channels of a voxel side
/// by side. Made from OpenVDB grids by to_volume().
struct Volume {
  BrickGrid<float> grid{GridTransform{}, 1};  ///< transform in world coordinates
  FieldChannels channels;
  std::vector<Component> component;  ///< per voxel, in the order of the grid's values; empty: unknown
  Box box_m;      ///< of what the voxels were made from, to be framed; else of the voxels that are occupied
  Box support_m;  ///< where interpolated extinction or scattering is not 0
  /// Of segments of rays through it, in voxels. Half of one unless the file says otherwise: the field is linear over less
  /// than that. Learned volumes are what their training's segments saw.
  double longest_segment = 0.5;
  std::uint64_t n_occupied_voxels = 0;  ///< with extinction or scattering

  std::uint64_t memory_bytes() const;
};

}  // namespace sarnerf
