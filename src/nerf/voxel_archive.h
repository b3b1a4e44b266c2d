// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/carving.h"

namespace sarnerf {

/// Puts a sparse grid's topology and the ascending places of its active voxels into an archive, as the tensors
/// "bricks" [n_bricks, 3] and "voxels" [n_active].
void add_voxels(Archive& archive, const BrickTopology& topology,
                std::span<const std::uint32_t> active);

/// Their inverse. Throws CheckpointError for damaged contents.
CarvedVoxels voxels_of(const Archive& archive, const std::string& where);

}  // namespace sarnerf
