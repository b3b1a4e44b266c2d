// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// What a render is to say about its own error.
struct ErrorRequest {
  bool estimate = true;
  bool map = false;           ///< a value per pixel, too
  bool by_direction = false;  ///< elevation rays and slices apart, too
};

/// What a render says about its own error E = ‖I − I*‖₂ / ‖I*‖₂, I* the limit of infinitely many rays and
/// slices and of vanishing voxels of the same scene: found from coarser samplings contained in it. Not a
/// bound: docs/accuracy.md shows how far to trust it. NaN where it is not known.
struct ErrorEstimate {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  double relative = kUnknown;     ///< E
  double elevation = kUnknown;    ///< part of it that more elevation rays would mend
  double along_track = kUnknown;  ///< part of it that more slices a row would mend
  Image<float> map;               ///< expected |I − I*| of each pixel; an engine moves it to Layers::error
};

}  // namespace sarnerf
