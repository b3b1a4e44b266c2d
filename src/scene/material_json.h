// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "json_view.h"
#include "sarnerf/scene/material.h"

namespace sarnerf {

/// The materials of an object whose keys are their names. Throws InputError for unknown keys, for values
/// without meaning, and for materials that are both opaque and translucent.
std::vector<Material> parse_materials(const JsonView& materials);

}  // namespace sarnerf
