// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/optim/adam.h>

#include <memory>

#include "sarnerf/core/monitor.h"
#include "field_learner.h"
#include "sarnerf/nerf/mlp_field.h"

namespace sarnerf {

/// Learns an MlpField: Adam over all weights, and now and then a look at where there is matter.
class MlpLearner : public FieldLearner {
 public:
  MlpLearner(const TrainingSet& set, const MlpOptions& options, std::uint64_t seed, const Monitor& monitor = {});

  const LearnedField& field() const override { return field_; }
  bool adapt(double progress, const TrainingSet& set, const RaySampling& sampling) override;
  void minimise(const torch::Tensor& loss, double rate) override;
  Archive state() const override;
  void restore(const Archive& archive, const std::string& where) override;

 private:
  void restart_optimiser();
  torch::optim::AdamParamState* moments() const;  ///< null before the first step

  MlpOptions options_;
  MlpField field_;
  std::unique_ptr<torch::optim::Adam> adam_;
  std::int64_t steps_since_refresh_ = 0;
};

}  // namespace sarnerf
