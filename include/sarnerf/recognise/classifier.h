// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

#include <torch/types.h>

/// Classifiers of SAR chips, learned from a few measured chips of each class and views that were generated from them.
///
/// This module uses LibTorch and core/error.h alone, so that it can be built where there is nothing else (apps/sar_recognise).
namespace sarnerf {

/// Chips of one size and their classes.
struct LabelledChips {
  torch::Tensor amplitude;   ///< [n, rows, columns] float32, linear
  torch::Tensor label;       ///< [n] int64, from 0
  torch::Tensor pose_deg{};  ///< [n, 2] float64, azimuth and depression; undefined where they are not known. No classifier sees it

  std::int64_t size() const { return amplitude.defined() ? amplitude.size(0) : 0; }
};

/// Whether all labels are in [0, n_classes).
inline bool has_labels_of(const LabelledChips& chips, std::int64_t n_classes) {
  return chips.size() == 0 || (chips.label.min().item<std::int64_t>() >= 0 && chips.label.max().item<std::int64_t>() < n_classes);
}

/// What a classifier learns from.
struct TrainingChips {
  LabelledChips shots;      ///< measured
  LabelledChips generated;  ///< from the shots; may be empty
};

enum class Classifier {
  a_convnet,          ///< Chen et al. 2016: five convolutions, 88 × 88 pixels, no dense layer
  resnet50,           ///< He et al. 2016, 64 × 64 pixels, from random weights
  nearest_neighbour,  ///< the class of the chip with the highest correlation; 48 × 48 pixels, blurred
  background,         ///< logistic regression on the four corners of 88 × 88 pixels: what the clutter alone gives away
  texture,            ///< three convolutions of 24 × 24 pixels and their mean: for patches of clutter, not for targets
};

/// Whether it is trained by gradient descent, on the device of the options. The others run on the CPU.
inline bool is_network(Classifier c) { return c == Classifier::a_convnet || c == Classifier::resnet50 || c == Classifier::texture; }

/// "a-convnet", "resnet50", "nearest", "background", "texture".
std::string_view name(Classifier classifier);

/// Side of the square that a classifier looks at (pixels), the same for all chips.
int crop_pixels(Classifier classifier);

/// The four corners [n, side, side] of chips [n, rows, columns]: background, where no target is. Views of the chips, which must be that large.
std::array<torch::Tensor, 4> corners_of(const torch::Tensor& chips, int side);

/// Raised whenever the same chips and options would give other networks. All cells of a study have the same.
inline constexpr int kTrainingMethod = 1;

/// How networks are trained. Every arm of a study has the same.
struct ClassifierOptions {
  int n_steps = 600;
  int batch = 64;
  /// AdamW (Loshchilov and Hutter 2019). The rate rises linearly over the first three tenths of the steps and falls by a cosine to 0.
  double rate = 2e-3, weight_decay = 1e-2;
  /// Part of each label's probability that is spread evenly over all classes (Szegedy et al. 2016): few shots are learned less by heart.
  double label_smoothing = 0.1;
  /// Random shifts of the crop, and random factors on normalised chips.
  int shift_pixels = 8;
  double gain_jitter = 0.1;
  /// Part of a batch that is drawn from the shots, if there are generated chips.
  double shot_fraction = 0.5;
  std::uint64_t seed = 1;  ///< of weights, batches, crops and dropout
  torch::Device device = torch::kCPU;  ///< where networks are trained; chips may stay where they are
};

/// Called after each step; may throw to stop.
using ProgressReport = std::function<void(int done, int total)>;

/// Learns and classifies. Returns the scores [n_test, n_classes] float32: the class with the highest one is the answer. Scores are
/// log-probabilities of networks and of the logistic regression, and correlations of the nearest neighbour.
///
/// Chips become the square root of amplitude, cropped about their centre (in training: shifted by up to `shift_pixels`), with mean 0
/// and standard deviation 1 each, so that no chip's gain gives its class away. Batches draw a class, then a chip of it. Nothing of
/// the test chips is used before the end, and nothing is chosen by them. Of a class without generated chips its shots are drawn instead, so
/// that classes stay equally frequent.
///
/// The same device, instruction set and number of threads repeat a training exactly. Others round sums differently, which grows to about a point of
/// accuracy; on a GPU the dropout of the A-ConvNet also takes other random numbers, so that its batches differ from those of a CPU.
///
/// Throws NumericsError if a network diverges, and std::invalid_argument for chips smaller than crop and shifts need, and for labels outside [0, n_classes).
/// Cost of a step with a batch of 64 on two cores: A-ConvNet 0.12 s, ResNet-50 1 s. Nearest neighbour: training × test × 2304
/// multiplications.
torch::Tensor classify(Classifier classifier, const TrainingChips& training, const torch::Tensor& test_amplitude, int n_classes,
                       const ClassifierOptions& options, const ProgressReport& report = {});

/// Square root of amplitude, the central `side` × `side` pixels, moved by (row, column), mean 0 and standard deviation 1:
/// [n, side, side]. A constant chip becomes 0.
torch::Tensor normalised_crops(const torch::Tensor& amplitude, int side, int row = 0, int column = 0);

/// Both, one behind the other; either may be empty.
LabelledChips joined(const LabelledChips& a, const LabelledChips& b);

}  // namespace sarnerf
