// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/openvdb.h>

#include <string>
#include <vector>

#include "learned_volume.h"
#include "sarnerf/bake/extract.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf {

/// Names of the grids that volume_grids() makes.
std::vector<std::string> grid_names(const FieldChannels& channels);

/// The volume as grids of docs/volumes.md, an active voxel for each with extinction or brightness. `in_world`: the
/// transform of all of them, the occupancy's too, which is given it here. `as_half`: brightness is written with 11 bits, in
/// half the time; for volumes that were interpolated anyhow.
VdbScene volume_grids(const LearnedVolume& volume, const GridTransform& in_world,
                      const openvdb::FloatGrid::Ptr& occupancy, bool as_half);

/// Adds to the volume's metadata what it was made from and how.
void describe(VdbScene& volume, const Model& model, const ExtractOptions& options, const Extraction& extraction);

}  // namespace sarnerf
