// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/level_ground.h"

namespace sarnerf {

/// A ground in a model file, and its inverse: null where the archive has none. Throws CheckpointError for a damaged one.
void add_ground(Archive& archive, const LevelGround& ground);
std::shared_ptr<const LevelGround> ground_of(const Archive& archive, const std::string& where);

}  // namespace sarnerf
