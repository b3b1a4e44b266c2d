// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/types.h>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// A copy of an image's pixels, [n_azimuth, n_range] float32, and its inverse.
torch::Tensor tensor_of(const Image<float>& image);
Image<float> image_of(const torch::Tensor& pixels);

}  // namespace sarnerf
