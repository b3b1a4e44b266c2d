// SPDX-License-Identifier: Apache-2.0
#include "field/tensors.h"

#include <algorithm>

namespace sarnerf {

torch::Tensor tensor_of(const Image<float>& image) {
  torch::Tensor pixels = torch::empty({image.n_azimuth(), image.n_range()}, torch::kFloat);
  std::copy(image.pixels().begin(), image.pixels().end(), pixels.data_ptr<float>());
  return pixels;
}

Image<float> image_of(const torch::Tensor& pixels) {
  const torch::Tensor whole = pixels.contiguous();
  Image<float> image(static_cast<int>(whole.size(0)), static_cast<int>(whole.size(1)));
  std::copy_n(whole.data_ptr<float>(), whole.numel(), image.pixels().begin());
  return image;
}

}  // namespace sarnerf
