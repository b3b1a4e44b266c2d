// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/optim/adam.h>

#include <optional>

#include "field_learner.h"
#include "grid_learning.h"
#include "smoothness.h"

namespace sarnerf {

/// Learns a GridField: halves its voxels and gives up those that are not needed as training goes on.
class GridLearner : public FieldLearner {
 public:
  GridLearner(const TrainingSet& set, const GridOptions& options);

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, const TrainingSet& set, const RaySampling& sampling) override;
  void minimise(const torch::Tensor& loss, double rate) override;
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  void restart_optimiser();
  void add_smoothness();
  std::vector<torch::optim::AdamParamState*> moments();

  GridOptions options_;
  GridField field_;
  std::unique_ptr<torch::optim::Adam> adam_;
  std::optional<Neighbourhood> neighbours_;  ///< of the present voxels, once it was asked for
  int level_ = 0;      ///< halvings so far
  int n_prunings_ = 0;
};

}  // namespace sarnerf
