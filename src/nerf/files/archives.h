// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/nerf/occupancy_grid.h"
#include "sarnerf/nerf/ground.h"
#include "sarnerf/nerf/learned_field.h"

namespace sarnerf {

using Json = nlohmann::ordered_json;

/// Sets a member of an archive's JSON object.
void add_text(Archive& archive, const std::string& name, const Json& value);

/// A member of an archive's JSON object. Throws CheckpointError if it or the object is missing.
Json text_of(const Archive& archive, const std::string& name, const std::string& where);

/// A member of an object. Throws CheckpointError when it is missing or of another type.
template <class T>
T member(const Json& object, const std::string& name, const std::string& where) {
  try {
    return object.at(name).get<T>();
  } catch (const nlohmann::json::exception&) {
    throw CheckpointError(where + ": '" + name + "' is missing or of another type than expected; was it written by "
                          "another version?");
  }
}

/// Adds a ground to an archive, and reads it back: null if the archive has none. Throws CheckpointError for a damaged one.
void add_ground(Archive& archive, const LevelGround& ground);
std::shared_ptr<const LevelGround> ground_of(const Archive& archive, const std::string& where);

/// Adds a resolution to an archive, and reads it back: empty if the archive has none. Throws CheckpointError for a damaged one.
void add_resolution(Archive& archive, const Resolution& resolution);
std::optional<Resolution> resolution_of(const Archive& archive, const std::string& where);

/// Adds a sparse grid's topology and the ascending indices of its active voxels to an archive, as the tensors
/// "bricks" [n_bricks, 3] and "voxels" [n_active].
void add_voxels(Archive& archive, const BrickTopology& topology,
                std::span<const std::uint32_t> active);

/// Inverse of add_voxels(). Throws CheckpointError for damaged contents.
CarvedVoxels voxels_of(const Archive& archive, const std::string& where);

/// The trainer's own state in a checkpoint.
struct TrainerJson {
  std::string options;  ///< options_json()
  std::int64_t steps = 0;
  double least_error = 0.0;  ///< DivergenceGuard::least()
};

void add_trainer_json(Archive& archive, const TrainerJson& trainer);
TrainerJson trainer_json(const Archive& archive, const std::string& where);

}  // namespace sarnerf
