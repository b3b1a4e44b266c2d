// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/types.h>

#include <span>
#include <string>
#include <vector>

#include "grid_learning.h"
#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

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
