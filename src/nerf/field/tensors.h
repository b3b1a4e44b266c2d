// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>

#include <torch/types.h>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// The numbers of a contiguous float32 tensor, in its memory.
inline std::span<float> numbers(const torch::Tensor& tensor) {
  return {tensor.data_ptr<float>(), static_cast<std::size_t>(tensor.numel())};
}

/// A copy of an image's pixels, [n_azimuth, n_range] float32, and its inverse.
inline torch::Tensor tensor_of(const Image<float>& image) {
  torch::Tensor pixels = torch::empty({image.n_azimuth(), image.n_range()}, torch::kFloat);
  std::copy(image.pixels().begin(), image.pixels().end(), pixels.data_ptr<float>());
  return pixels;
}
inline Image<float> image_of(const torch::Tensor& pixels) {
  const torch::Tensor whole = pixels.contiguous();
  Image<float> image(static_cast<int>(whole.size(0)), static_cast<int>(whole.size(1)));
  std::copy_n(whole.data_ptr<float>(), whole.numel(), image.pixels().begin());
  return image;
}

}  // namespace sarnerf
