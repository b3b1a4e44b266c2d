// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "sarnerf/core/impulse_response.h"
#include "sarnerf/nerf/archive.h"

namespace sarnerf {

/// A resolution in a model file, and its inverse: nothing where the archive has none. Throws CheckpointError for a damaged one.
void add_resolution(Archive& archive, const Resolution& resolution);
std::optional<Resolution> resolution_of(const Archive& archive, const std::string& where);

}  // namespace sarnerf
