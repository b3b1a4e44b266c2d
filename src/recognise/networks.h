// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/nn/modules/container/sequential.h>

namespace sarnerf {

/// A-ConvNet (Chen, Wang, Xu and Jin, IEEE TGRS 2016): convolutions of 5 × 5 × 16, 5 × 5 × 32 and 6 × 6 × 64, each with ReLU and
/// 2 × 2 maximum; dropout; 5 × 5 × 128 with ReLU; 3 × 3 × classes. [n, 1, 88, 88] → [n, classes]. Batch normalisation is left out, as in
/// the paper: with 8 shots it costs 0.5 to 11 points, by rate and smoothing (docs/results/recognition_choices.md).
torch::nn::Sequential a_convnet(int n_classes);

/// ResNet-50 (He, Zhang, Ren and Sun, CVPR 2016) for one channel: 7 × 7 / 2, 3 × 3 maximum / 2, then 3, 4, 6 and 3 bottlenecks,
/// which halve the image in their 3 × 3 convolution (the paper: in the first 1 × 1).
/// [n, 1, h, w] → [n, classes].
torch::nn::Sequential resnet50(int n_classes);

/// Three convolutions of 3 × 3, with 16, 32 and 64 features, and the mean over all pixels: it sees texture, not shape.
/// [n, 1, h, w] → [n, classes].
torch::nn::Sequential texture_network(int n_classes);

}  // namespace sarnerf
