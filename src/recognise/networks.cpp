// SPDX-License-Identifier: Apache-2.0
#include "networks.h"

#include <torch/nn/modules/activation.h>
#include <torch/nn/modules/batchnorm.h>
#include <torch/nn/modules/conv.h>
#include <torch/nn/modules/dropout.h>
#include <torch/nn/modules/linear.h>
#include <torch/nn/modules/pooling.h>

namespace sarnerf {

namespace nn = torch::nn;

namespace {

/// A convolution of one channel, the maximum of each 2 × 2 pixels, and rectification: Conv2d, MaxPool2d and ReLU in about two thirds of
/// their time. Each of the four pixels is a convolution of its own, by 3 × 3 blocks of 2 × 2 pixels, so that the maximum is one over channels.
struct FirstConvolutionImpl : nn::Module {
  FirstConvolutionImpl(int to, int side) : convolution(register_module("convolution", nn::Conv2d(nn::Conv2dOptions(1, to, side)))) {}

  torch::Tensor forward(const torch::Tensor& chips) {  // [n, 1, 2a, 2b]
    std::vector<torch::Tensor> kernels;
    for (const int row : {0, 1})
      for (const int column : {0, 1})
        kernels.push_back(torch::pixel_unshuffle(torch::constant_pad_nd(convolution->weight, {column, 1 - column, row, 1 - row}), 2));
    const torch::Tensor four = torch::conv2d(torch::pixel_unshuffle(chips, 2), torch::cat(kernels));
    const std::int64_t n = four.size(0), channels = four.size(1) / 4, rows = four.size(2), columns = four.size(3);
    const torch::Tensor most = std::get<0>(four.view({n, 4, channels * rows * columns}).max(1));
    return torch::relu(most.view({n, channels, rows, columns}) + convolution->bias.view({1, -1, 1, 1}));
  }

  nn::Conv2d convolution;
};
TORCH_MODULE(FirstConvolution);

}  // namespace

torch::nn::Sequential a_convnet(int n_classes) {
  nn::Sequential net;
  const auto convolve = [&](int from, int to, int side) { net->push_back(nn::Conv2d(nn::Conv2dOptions(from, to, side))); };
  // The maximum of rectified values is the rectified maximum: in this order a quarter of the pixels is rectified.
  const auto pool_and_rectify = [&] {
    net->push_back(nn::MaxPool2d(2));
    net->push_back(nn::ReLU());
  };
  net->push_back(FirstConvolution(16, 5));  // 88 → 84 → 42
  convolve(16, 32, 5);                      // → 38 → 19
  pool_and_rectify();
  convolve(32, 64, 6);  // → 14 → 7
  pool_and_rectify();
  net->push_back(nn::Dropout(0.5));
  convolve(64, 128, 5);  // → 3
  net->push_back(nn::ReLU());
  convolve(128, n_classes, 3);  // → 1
  net->push_back(nn::Flatten());
  return net;
}

torch::nn::Sequential texture_network(int n_classes) {
  nn::Sequential net;
  int from = 1;
  for (const int to : {16, 32, 64}) {
    net->push_back(nn::Conv2d(nn::Conv2dOptions(from, to, 3)));
    net->push_back(nn::BatchNorm2d(to));
    net->push_back(nn::ReLU());
    from = to;
  }
  net->push_back(nn::AdaptiveAvgPool2d(1));
  net->push_back(nn::Flatten());
  net->push_back(nn::Linear(from, n_classes));
  return net;
}

namespace {

nn::Conv2d convolution(int from, int to, int side, int stride) {
  nn::Conv2d layer(nn::Conv2dOptions(from, to, side).stride(stride).padding(side / 2).bias(false));
  nn::init::kaiming_normal_(layer->weight, 0.0, torch::kFanOut, torch::kReLU);
  return layer;
}

/// Reduces channels by 1 × 1, convolves by 3 × 3, and expands them fourfold by 1 × 1, beside the identity.
struct BottleneckImpl : nn::Module {
  static constexpr int kExpansion = 4;

  BottleneckImpl(int from, int width, int stride)
      : body(register_module("body", nn::Sequential(convolution(from, width, 1, 1), nn::BatchNorm2d(width), nn::ReLU(),
                                                    convolution(width, width, 3, stride), nn::BatchNorm2d(width), nn::ReLU(),
                                                    convolution(width, kExpansion * width, 1, 1),
                                                    nn::BatchNorm2d(kExpansion * width)))) {
    if (stride != 1 || from != kExpansion * width)
      shortcut = register_module("shortcut", nn::Sequential(convolution(from, kExpansion * width, 1, stride),
                                                            nn::BatchNorm2d(kExpansion * width)));
  }

  torch::Tensor forward(const torch::Tensor& x) {
    return torch::relu(body->forward(x) + (shortcut ? shortcut->forward(x) : x));
  }

  nn::Sequential body, shortcut{nullptr};
};
TORCH_MODULE(Bottleneck);

}  // namespace

torch::nn::Sequential resnet50(int n_classes) {
  nn::Sequential net(convolution(1, 64, 7, 2), nn::BatchNorm2d(64), nn::ReLU(),
                     nn::MaxPool2d(nn::MaxPool2dOptions(3).stride(2).padding(1)));
  int from = 64;
  for (const auto& [width, n_blocks] : {std::pair(64, 3), std::pair(128, 4), std::pair(256, 6), std::pair(512, 3)})
    for (int block = 0; block < n_blocks; ++block) {
      net->push_back(Bottleneck(from, width, block == 0 && width > 64 ? 2 : 1));
      from = BottleneckImpl::kExpansion * width;
    }
  net->push_back(nn::AdaptiveAvgPool2d(1));
  net->push_back(nn::Flatten());
  net->push_back(nn::Linear(from, n_classes));
  return net;
}

}  // namespace sarnerf
