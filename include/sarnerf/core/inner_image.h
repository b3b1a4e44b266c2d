// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"

namespace sarnerf {

/// The image without a border on every side, which must leave something.
template <class T>
Image<T> without_border(Image<T> image, const Border& border) {
  if (border.azimuth == 0 && border.range == 0) return image;
  Image<T> inside(image.n_azimuth() - 2 * border.azimuth, image.n_range() - 2 * border.range);
  for (int i = 0; i < inside.n_azimuth(); ++i) {
    const auto from = image.row(i + border.azimuth).subspan(static_cast<std::size_t>(border.range), inside.row(i).size());
    std::copy(from.begin(), from.end(), inside.row(i).begin());
  }
  return inside;
}

}  // namespace sarnerf
