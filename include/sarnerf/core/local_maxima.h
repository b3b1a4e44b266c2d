// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Which local maxima count.
struct MaximaRule {
  int most = 5;               ///< the strongest
  double separation_m = 1.0;  ///< of two; of nearer ones the stronger stays, so that side lobes count not
  double azimuth_spacing_m = 1.0, range_spacing_m = 1.0;  ///< of the pixels
};

struct LocalMaximum {
  int i = 0, j = 0;
  float value = 0.0f;
};

/// The strongest pixels that no one of their eight neighbours exceeds, above `floor`, strongest first; of equal ones
/// the first in the image. Throws UsageError for spacings that are not positive, a negative separation and fewer than
/// one maximum. Cost: nine comparisons a pixel, and the sorting of what is left.
std::vector<LocalMaximum> strongest_maxima(const Image<float>& image, double floor,
                                           const MaximaRule& rule = {});

/// Mean distance (m) of the reference's maxima to the nearest one of the others'. Throws UsageError where either has
/// none.
double mean_distance_m(const std::vector<LocalMaximum>& reference,
                       const std::vector<LocalMaximum>& others, const MaximaRule& rule = {});

}  // namespace sarnerf
