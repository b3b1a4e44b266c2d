// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"

namespace sarnerf {

template <class T>
std::string size_text(const Image<T>& image) {
  return std::to_string(image.n_azimuth()) + " x " + std::to_string(image.n_range());
}

/// Throws UsageError unless an image and what it is compared with have the same numbers of rows and columns.
template <class A, class B>
void require_same_size(const Image<A>& image, const Image<B>& reference) {
  if (image.n_azimuth() == reference.n_azimuth() && image.n_range() == reference.n_range()) return;
  throw UsageError("two images to compare must have one size; the image has " + size_text(image) +
                   " pixels, the reference " + size_text(reference));
}

}  // namespace sarnerf
