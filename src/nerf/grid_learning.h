// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {

/// One azimuth row of one of the images.
struct RowReference {
  std::uint32_t view, row;
};

/// The rows whose strip meets the box: others are 0 whatever is learned.
std::vector<RowReference> rows_that_see(const TrainingSet& set, const Box& box_m);

/// Some rows that stand for all of those that meet a box.
struct RowsOfPass {
  std::vector<RowReference> rows;
  double share = 1.0;  ///< of all
};

/// Between `n_wanted` and twice as many, evenly spread over the views and over each image; all, where there are fewer.
RowsOfPass rows_of_pass(const TrainingSet& set, const Box& box_m, std::size_t n_wanted);

/// Fog wherever carving leaves room for matter, of the brightness that the images have.
GridField initial_grid_field(const TrainingSet& set, const GridOptions& options, const Monitor& monitor = {});

/// 1 for each active voxel to keep: its two-way depth is at least prune_depth, and what the rows return of its brightness
/// exceeds prune_exposure pixels a view. Voxels below the first are empty, those below the second hidden.
std::vector<std::uint8_t> worth_keeping(const GridField& field, const TrainingSet& set, const RowsOfPass& pass,
                                        const RaySampling& sampling, const GridOptions& options);

}  // namespace sarnerf
