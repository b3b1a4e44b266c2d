// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <torch/types.h>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// An impulse response B as matrices. X is the mean power of an image and a border around it; B X = A X R is the result of
/// convolve_power() inside of the border. Iterations are fast as products of matrices.
struct ResponseMatrix {
  Border border;
  torch::Tensor azimuth;  ///< A [n_azimuth, n_azimuth + 2 border], float32
  torch::Tensor range;    ///< R [n_range + 2 border, n_range]

  torch::Tensor of(const torch::Tensor& wide) const { return azimuth.matmul(wide).matmul(range); }
  torch::Tensor adjoint_of(const torch::Tensor& image) const { return azimuth.t().matmul(image).matmul(range.t()); }
};

/// The matrices of the views, in their order; views of equal size and spacing share them. Throws UsageError if a spacing
/// under-samples the resolution.
std::vector<std::shared_ptr<const ResponseMatrix>> response_matrices(const std::vector<PosedImage>& images,
                                                                     const Resolution& resolution);

/// Richardson-Lucy deconvolution of each image by itself (Richardson 1972, Lucy 1974): non-negative power that, convolved with
/// the response, gives the image. Pixels 40 dB below the largest pixel of all images are set to 0: they are only tails that the
/// iteration has not removed yet.
///
/// Throws UsageError if a spacing under-samples the resolution. Cost: 240 products of matrices a view.
std::vector<PosedImage> richardson_lucy(const std::vector<PosedImage>& images, const Resolution& resolution);

}  // namespace sarnerf
