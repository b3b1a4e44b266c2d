// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/core/image.h"

/// An image with its azimuth rows in the other order: of the same scene from the same place, with the radar flying the other way.
inline sarnerf::Image<float> rows_reversed(const sarnerf::Image<float>& image) {
  sarnerf::Image<float> reversed(image.n_azimuth(), image.n_range());
  for (int i = 0; i < image.n_azimuth(); ++i)
    for (int j = 0; j < image.n_range(); ++j) reversed(i, j) = image(image.n_azimuth() - 1 - i, j);
  return reversed;
}
