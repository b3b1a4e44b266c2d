// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// Image size that contains the scene in every given view.
struct Framing {
  int n_azimuth = 0;
  int n_range = 0;
  std::string explanation;  ///< one line: what was fitted, in metres
};

/// The horizontal centre of the scene's box, at the box's lowest height. A scene without a mesh: (0, h, 0) with h the
/// ground's height (m), or 0 without a ground.
glm::dvec3 default_aim_m(const Scene& scene);

/// Smallest size, with a margin, whose image (centred on the aim point) contains the scene, its layover
/// and its shadow on the reference plane, at `reference_height_m` (default: the ground, else the scene's lowest height), in each of
/// the views. Reads only the poses of the views, and the
/// spacings of the first. Throws UsageError for a size beyond 65,535 pixels a side.
Framing frame_scene(const Scene& scene, std::span<const Acquisition> views, std::optional<double> reference_height_m = {});

/// "the scene measures 10 km: …", for images that are too large: most often the unit is wrong. Empty for a ground alone.
std::string scene_size_hint(const Scene& scene);

/// One line when the scene measures less than two pixels in azimuth and in range, else empty: most often the unit
/// is wrong.
std::string few_pixels_warning(const Scene& scene, const Acquisition& view);

/// One line when the scene lies outside the swath, wholly or in part; else empty.
std::string outside_swath_warning(const Scene& scene, const Acquisition& view);

}  // namespace sarnerf
