// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/despeckled_evaluation.h"

#include "sarnerf/core/error.h"
#include "sarnerf/core/gaussian_blur.h"

namespace sarnerf {

Evaluation evaluate_despeckled(const DespeckledTruth& truth,
                               std::span<const Image<float>> predictions,
                               std::span<const PosedImage> training, EvaluationSettings settings,
                               const Monitor& monitor) {
  std::vector<Image<float>> of_truth;
  if (!predictions.empty()) {
    for (const std::size_t n : truth.which) {
      if (n >= predictions.size()) {
        throw UsageError("a despeckled truth needs predictions of all views that it was made of; " +
                         std::to_string(predictions.size()) + " are too few");
      }
      of_truth.push_back(predictions[n]);
    }
  }
  Bound blurred{"true neighbours, blurred by 1", {}};
  for (const Image<float>& image : truth.true_neighbours)
    blurred.images.push_back(gaussian_blur(image, 1.0));
  settings.bounds.push_back({"true neighbours", truth.true_neighbours});
  settings.bounds.push_back(std::move(blurred));
  return evaluate(truth.views, of_truth, training, settings, monitor);
}

}  // namespace sarnerf
