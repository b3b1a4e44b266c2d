// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// Image size that holds the scene in every given view.
struct Framing {
  int n_azimuth = 0;
  int n_range = 0;
  std::string explanation;  ///< one line: what was fitted, in metres
};

/// The horizontal centre of the scene's box at its lowest height, or of the ground when there is one.
glm::dvec3 default_aim_m(const Scene& scene);

/// Smallest size, with a margin, whose image (centred on the aim point) holds the scene, its layover
/// and, down to the reference plane, its shadow in each of the views. Only the pose and the spacings
/// of the views are read. Throws UsageError for a size beyond 65,535 pixels a side.
Framing frame_scene(const Scene& scene, std::span<const Acquisition> views);

/// "the scene measures 10 km: …", for images that are too large: a wrong unit, most of the time. Empty for a ground alone.
std::string scene_size_hint(const Scene& scene);

/// One line when the scene measures less than two pixels in azimuth and in range, else empty: a wrong unit,
/// most of the time.
std::string few_pixels_warning(const Scene& scene, const Acquisition& view);

/// One line when nothing or only a part of the scene falls inside the swath, else empty.
std::string outside_swath_warning(const Scene& scene, const Acquisition& view);

}  // namespace sarnerf
