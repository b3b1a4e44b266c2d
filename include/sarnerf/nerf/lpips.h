// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "sarnerf/core/image.h"

namespace sarnerf {

/// Learned perceptual image patch similarity (Zhang et al. 2018) in its AlexNet form, version 0.1: how differently
/// the layers of a network trained on photographs respond to two images; 0 for equal ones, smaller for more alike
/// ones. The network is not part of this program: the user provides a file of its weights (docs/guide/lpips.md).
///
/// Power is divided by the peak, clamped to [0, 1], repeated in three channels, mapped to [−1, 1] and normalised
/// channel by channel as the published network expects. With y_l(c) the features after the ReLU of convolution l,
///
///     d = Σ_l mean over positions of Σ_c w_l(c) (ŷ_l(c) − ŷ'_l(c))²,   ŷ = y / (√(Σ_c y(c)²) + 1e-10)
///
/// in float32. Copies share the weights, and may be used by several threads at once.
class Lpips {
 public:
  /// Smallest number of rows and columns for which the network has an output.
  static constexpr int kSmallestSide_pixels = 31;

  /// Reads a safetensors file with the float32 tensors `features.N.weight` [out, in, k, k] and
  /// `features.N.bias` [out] for N = 0, 3, 6, 8, 10 with k = 11, 5, 3, 3, 3, and `linM.model.1.weight`
  /// [1, out, 1, 1] for M = 0 … 4; others are ignored. Channel counts are the file's. Throws InputError, naming the
  /// tensor, for a file that is missing or damaged, for missing tensors, for other shapes or types and for values
  /// that are not finite. Cost: reading the file.
  explicit Lpips(const std::filesystem::path& weights);

  /// Distance of two power images. Throws UsageError where sizes differ, a side is shorter than
  /// kSmallestSide_pixels or the peak is not positive and finite; NumericsError where pixels are not numbers. Cost:
  /// 0.8 GFLOP for 128 × 128 pixels and the published channel counts, in LibTorch's threads.
  double operator()(const Image<float>& power, const Image<float>& reference, double peak) const;

 private:
  struct Network;
  std::shared_ptr<const Network> network_;
};

}  // namespace sarnerf
