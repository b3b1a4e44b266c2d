// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/types.h>

#include <memory>
#include <vector>

#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// What an impulse response makes of the mean power of one size of image, B X = A X R, as convolve_power() has it: both
/// factors are symmetric, and so B is its own adjoint. Nothing comes in from beyond the borders. In products of matrices,
/// which is what iterations ask for.
struct ResponseMatrix {
  torch::Tensor azimuth, range;  ///< A [n_azimuth, n_azimuth], R [n_range, n_range], float32

  torch::Tensor of(const torch::Tensor& image) const { return azimuth.matmul(image).matmul(range); }
};

/// The matrices of views in their order; views of one size and spacing share theirs. Throws UsageError where a spacing
/// under-samples the resolution.
std::vector<std::shared_ptr<const ResponseMatrix>> response_matrices(const std::vector<PosedImage>& images,
                                                                     const Resolution& resolution);

}  // namespace sarnerf
