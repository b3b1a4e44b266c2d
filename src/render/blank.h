// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// What rendering saw of a view whose image is all zero.
struct BlankEvidence {
  std::uint64_t n_hits = 0;  ///< of opaque faces, or of rays that met a volume
  bool volume = false;       ///< voxels instead of a mesh with materials
};

/// Why the image is blank, and what to do: one line. A blank image is never silent.
std::string explain_blank(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence);

}  // namespace sarnerf
