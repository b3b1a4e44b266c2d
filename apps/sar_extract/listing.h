// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sarnerf/bake/extract.h"

namespace sarnerf::app {

/// The grids of a volume, a line each: name, type, voxels, box, memory; then its metadata.
std::string listing(const Extraction& extraction);

}  // namespace sarnerf::app
