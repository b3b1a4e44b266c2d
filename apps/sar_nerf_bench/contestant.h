// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "sarnerf/core/image.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf::bench {

/// A way of learning a scene, as the study sees it.
class Contestant {
 public:
  virtual ~Contestant() = default;

  /// One step of the optimiser; `progress` in [0, 1) is the share of the planned time that is over.
  /// Throws NumericsError when training diverges.
  virtual void step(double progress) = 0;

  /// What it makes of a view by now: β⁰. The acquisition's aim point is the origin.
  virtual Image<float> render(const Acquisition& acquisition) const = 0;
};

/// `grid` and `mlp` are the Trainer's with default options, `plain` is PlainLearner. Initialises the
/// field: the time that takes is part of learning. Sets LibTorch's threads as suits the contestant.
std::unique_ptr<Contestant> make_contestant(const std::string& field, TrainingSet set,
                                            std::uint64_t seed);

}  // namespace sarnerf::bench
