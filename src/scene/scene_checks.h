// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/scene/scene.h"
#include "scene_file.h"
#include "triangle_soup.h"

namespace sarnerf {

/// Nothing lies farther from the origin on any axis: squares and volumes must stay in range.
inline constexpr double kFarthest_m = 1e12;

/// Throws InputError for coordinates so large that squares and volumes of them would overflow.
void require_reach(const MeshEntry& entry, const TriangleSoup& soup);

/// Warns of vertices stored in single precision so far from the origin that it shows.
void warn_about_precision(const MeshEntry& entry, const TriangleSoup& soup, SceneReport& report);

/// Warns of scenes that are probably in other units than was said, and of ground above everything.
void warn_about_size(Scene& scene);

}  // namespace sarnerf
