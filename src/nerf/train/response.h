// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <torch/types.h>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// What an impulse response makes of the mean power X of an image and a border around it: B X = A X R, what
/// convolve_power() leaves inside of the border. In products of matrices, which is what iterations ask for.
struct ResponseMatrix {
  Border border;
  torch::Tensor azimuth;  ///< A [n_azimuth, n_azimuth + 2 border], float32
  torch::Tensor range;    ///< R [n_range + 2 border, n_range]

  torch::Tensor of(const torch::Tensor& wide) const { return azimuth.matmul(wide).matmul(range); }
  torch::Tensor adjoint_of(const torch::Tensor& image) const { return azimuth.t().matmul(image).matmul(range.t()); }
};

/// The matrices of views in their order; views of one size and spacing share theirs. Throws UsageError where a spacing
/// under-samples the resolution.
std::vector<std::shared_ptr<const ResponseMatrix>> response_matrices(const std::vector<PosedImage>& images,
                                                                     const Resolution& resolution);

/// What the images would show without their impulse response, as far as each tells by itself: power that is nowhere
/// negative and, seen through the response, is the image (Richardson 1972, Lucy 1974). What is 40 dB below the largest pixel
/// of all, and is no more than the tails that the iteration has not taken away yet, is 0.
///
/// Cost: 240 products of matrices a view. Throws UsageError where a spacing under-samples the resolution.
std::vector<PosedImage> richardson_lucy(const std::vector<PosedImage>& images, const Resolution& resolution);

}  // namespace sarnerf
