// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// Voxels that may hold matter.
struct CarvedVoxels {
  BrickTopology topology;
  std::vector<std::uint8_t> active;  ///< [512 n_bricks]
};

/// The voxels of the set's box without those that are certainly empty: nothing stands in front of what a row
/// returns first, so a place nearer than the first pixel above 0 (a millionth of the peak) of its own row and of its neighbours, by
/// a voxel or more, is empty. One view that says so suffices. A place outside of all swaths
/// is given up, too.
///
/// Images with a background that returns power carve nothing so but what lies outside of all swaths. Over a level ground
/// (Clutter) a place is empty when three in ten of the views that see it show ground both in its pixel and where its shadow
/// would lie, or when fewer than a quarter of all views see it; nothing lies below. Cost: views × voxels, a few ns
/// each.
CarvedVoxels carve(const TrainingSet& set, const GridTransform& transform, const Monitor& monitor = {});

/// The grid whose voxels' centres fill the set's box, centred in it.
GridTransform grid_transform(const TrainingSet& set, double voxel_size_m);

}  // namespace sarnerf
