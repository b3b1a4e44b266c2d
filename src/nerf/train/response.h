// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <torch/types.h>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/learned_field.h"
#include "sarnerf/nerf/training_set.h"
#include "train/grid_learner.h"

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
std::vector<PosedImage> sharpened(const std::vector<PosedImage>& images, const Resolution& resolution);

/// Azimuth rows of speckled views whose impulse response B is part of the model. Speckle cannot be sharpened. Instead errors
/// are those of whole views, seen through B, over μ + floor as the likelihood of speckle has it, bounded as Huber's:
///
///     e = ψ((μ − I) / (μ + floor)),     μ = B f,     ∂ ½ Σ e² / ∂ f = Bᵀ e / (μ + floor)
///
/// with μ in the denominator held constant. Rows of f are rendered a few at a time: each takes the others of its view as they
/// were rendered last, so that none is rendered for its neighbours' sake; to begin with they are the ground.
class RowsThroughResponse {
 public:
  /// Of a set with a ground and a resolution. `floor` 0: errors of power, not relative ones. `most` 0: no bound.
  RowsThroughResponse(const TrainingSet& set, double floor, double most);

  /// Pseudo-targets of rows that have just been rendered, one behind the other: with them in the place of the image, the sum
  /// of squares of (pixel − target) / (sg(pixel) + floor) has twice the gradient above. `counts` is 0 where a row was not
  /// rendered.
  /// Cost: a product of matrices of the image's size for each axis of each view that has a row.
  torch::Tensor wanted(std::span<const RowReference> rows, const torch::Tensor& pixels, const torch::Tensor& counts);

  /// What was rendered last, under "rendered_rows", and back. Throws CheckpointError.
  void save(Archive& archive) const;
  void restore(const Archive& archive, const std::string& where);

 private:
  struct View {
    torch::Tensor azimuth, range;  ///< A [n_azimuth, n_azimuth] and R [n_range, n_range], symmetric: B f = A f R
    torch::Tensor image, rendered;
    float level = 0.0f;  ///< what lies beyond the borders: the ground's mean
  };
  torch::Tensor inverse_scale(const torch::Tensor& power) const;
  torch::Tensor gradient(const View& view) const;

  std::vector<View> views_;
  double floor_, most_;
};

}  // namespace sarnerf
