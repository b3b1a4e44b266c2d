// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image.h"

namespace sarnerf {

/// exp(−d²/2σ²) at n positions a pixel apart, d the distance from their centre; scaled to a sum of 1.
std::vector<double> gaussian_weights(std::size_t n, double sigma_pixels);

template <class T>
std::string size_text(const Image<T>& image) {
  return std::to_string(image.n_azimuth()) + " x " + std::to_string(image.n_range());
}

/// Throws UsageError unless an image and its reference have the same numbers of rows and columns.
template <class A, class B>
void require_same_size(const Image<A>& image, const Image<B>& reference) {
  if (image.n_azimuth() == reference.n_azimuth() && image.n_range() == reference.n_range()) return;
  throw UsageError("two images to compare must have the same size; the image has " + size_text(image) +
                   " pixels, the reference " + size_text(reference));
}

}  // namespace sarnerf
