// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {

/// One azimuth row of one of the images.
struct RowReference {
  std::uint32_t view, row;
};

/// The rows whose strip meets the box: others are 0 whatever is learned.
std::vector<RowReference> rows_that_see(const TrainingSet& set, const Box& box_m);

/// Fog wherever carving leaves room for matter, of the brightness that the images have.
GridField initial_grid_field(const TrainingSet& set, const GridOptions& options);

/// For each active voxel whether it is neither as good as empty nor, over all rows, without a share in what they
/// return: hidden, or dark. One pass over the rows.
std::vector<std::uint8_t> worth_keeping(const GridField& field, const TrainingSet& set,
                                        std::span<const RowReference> rows, const RaySampling& sampling,
                                        const GridOptions& options);

}  // namespace sarnerf
