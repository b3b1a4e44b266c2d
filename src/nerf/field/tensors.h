// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <torch/types.h>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// The numbers of a contiguous float32 tensor, in its memory.
inline std::span<float> numbers(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), static_cast<std::size_t>(tensor.numel())};
}

/// A copy of an image's pixels, [n_azimuth, n_range] float32, and its inverse.
torch::Tensor tensor_of(const Image<float>& image);
Image<float> image_of(const torch::Tensor& pixels);

}  // namespace sarnerf
