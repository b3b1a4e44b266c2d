// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <torch/optim/adam.h>

#include "sarnerf/core/image.h"
#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf::bench {

/// A method of learning a scene, as the study uses it.
class Contestant {
 public:
  virtual ~Contestant() = default;

  /// One step of the optimiser; `progress` in [0, 1) is the elapsed fraction of the planned time. Throws
  /// NumericsError when training diverges.
  virtual void step(double progress) = 0;

  /// Renders a view in the present state of training: β⁰. The acquisition's aim point is the origin.
  virtual Image<float> render(const Acquisition& acquisition) const = 0;
};

/// `grid` and `mlp` are the Trainer's with default options, `plain` is PlainLearner. Initialises the field; the time
/// for that is part of learning. Sets LibTorch's threads to suit the contestant.
std::unique_ptr<Contestant> make_contestant(const std::string& field, TrainingSet set,
                                            std::uint64_t seed);

struct PlainOptions {
  MlpShape shape;                   ///< the paper's: 8 × 256, 10 and 4 frequencies
  double rate = 1e-3;               ///< of Adam, constant
  int warm_up_steps = 10;           ///< over which the rate rises to `rate`
  double initial_depth = 0.2;       ///< as in MlpOptions: a field that begins empty stays empty
  double initial_brightness = 0.3;  ///< as in MlpOptions
  std::uint64_t seed = 1;
};

/// The paper's method of learning, in LibTorch's own operations: the reference for the field `mlp`.
/// Printed eqs. 8–12, 24–31:
///
///     I_ij = (r_j Δθ / Δr) Σ_k S T tanh σ,   T = exp(−Σ_{j' ≤ j} σ),   σ = ReLU(σ_r)
///
/// A step renders one whole view, drawn in random order: all its azimuth rows, on each as many elevation rays as
/// there are range bins, over the angles under which the scene's box is seen, at every bin. The network is evaluated
/// at all of these points, in float32, with LibTorch's autograd. Nothing is carved, skipped or cached, and no native
/// kernel takes part. Gradients are summed row by row, since those of a whole view need 50 GB.
///
/// Choices that the paper does not state: the number of rays; Adam with a constant rate, relative to the peak;
/// S = s ln(1 + e^{S_r}) and the initial fog, without which ReLU learns nothing, as in MlpField.
class PlainLearner : public Contestant {
 public:
  PlainLearner(TrainingSet set, const PlainOptions& options);

  void step(double progress) override;

  /// Uses the processor's best kernel, so that the study need not wait for minutes: its bf16 error is far below the
  /// error that is left to learn. Not part of learning.
  Image<float> render(const Acquisition& acquisition) const override;

  /// One azimuth row, [n_range] float32, differentiable with respect to the parameters.
  torch::Tensor render_row(const RayGrid& grid, int row, MlpKernel kernel) const;

  /// The rays that sample an acquisition.
  RayGrid rays(const Acquisition& acquisition) const;

  /// Mean square over the pixels of the last step's view, relative to the peak's square.
  double last_loss() const { return last_loss_; }
  const MlpNetwork& network() const { return network_; }
  double source_scale() const { return set_.bright; }

 private:
  TrainingSet set_;
  PlainOptions options_;
  MlpNetwork network_;
  std::unique_ptr<torch::optim::Adam> adam_;
  std::mt19937_64 random_;
  std::vector<std::size_t> order_;  ///< views that are still to come in this round
  std::int64_t n_steps_ = 0;
  double last_loss_ = 0.0;
};

}  // namespace sarnerf::bench
