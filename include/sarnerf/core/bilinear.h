// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Bilinear value at a position in pixels: whole numbers are centres, pixels beyond the border are 0. 0 at a position
/// that is no number.
inline double bilinear(const Image<float>& image, double i, double j) {
  if (!(i > -1.0 && i < image.n_azimuth() && j > -1.0 && j < image.n_range())) return 0.0;
  const int i0 = static_cast<int>(std::floor(i)), j0 = static_cast<int>(std::floor(j));
  const double wi[2] = {1.0 - (i - i0), i - i0}, wj[2] = {1.0 - (j - j0), j - j0};
  double sum = 0.0;
  for (int a = 0; a < 2; ++a) {
    if (i0 + a < 0 || i0 + a >= image.n_azimuth()) continue;
    for (int b = 0; b < 2; ++b) {
      if (j0 + b < 0 || j0 + b >= image.n_range()) continue;
      sum += wi[a] * wj[b] * double{image(i0 + a, j0 + b)};
    }
  }
  return sum;
}

}  // namespace sarnerf
