// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "sarnerf/dataset/despeckled_truth.h"
#include "sarnerf/dataset/evaluation.h"

namespace sarnerf {

/// evaluate() on a despeckled truth, with two bounds: its true neighbours, and those blurred (σ of one pixel).
/// `predictions` are of all the views that the truth was made of, in their order, or none. Settings' own bounds must
/// be of the truth's views. Throws and costs as evaluate().
Evaluation evaluate_despeckled(const DespeckledTruth& truth,
                               std::span<const Image<float>> predictions,
                               std::span<const PosedImage> training, EvaluationSettings settings = {},
                               const Monitor& monitor = {});

}  // namespace sarnerf
