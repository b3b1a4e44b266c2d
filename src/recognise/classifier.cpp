// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/recognise/classifier.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <torch/optim/adamw.h>
#include <torch/optim/lbfgs.h>
#include <torch/utils.h>

#include "networks.h"
#include "sarnerf/core/error.h"

namespace sarnerf {

std::string_view name(Classifier classifier) {
  switch (classifier) {
    case Classifier::a_convnet: return "a-convnet";
    case Classifier::resnet50: return "resnet50";
    case Classifier::nearest_neighbour: return "nearest";
    case Classifier::background: return "background";
    case Classifier::texture: return "texture";
  }
  return "";
}

int crop_pixels(Classifier classifier) {
  switch (classifier) {
    case Classifier::resnet50: return 64;
    case Classifier::nearest_neighbour: return 48;
    case Classifier::texture: return 24;
    default: return 88;
  }
}

std::array<torch::Tensor, 4> corners_of(const torch::Tensor& chips, int side) {
  const std::int64_t last_row = chips.size(1) - side, last_column = chips.size(2) - side;
  const auto corner = [&](std::int64_t row, std::int64_t column) { return chips.narrow(1, row, side).narrow(2, column, side); };
  return {corner(0, 0), corner(0, last_column), corner(last_row, 0), corner(last_row, last_column)};
}

namespace {

/// So many test chips are asked about at once: of thousands of chips, convolutions would take gigabytes.
constexpr std::int64_t kPart = 256;

void require_room(const torch::Tensor& amplitude, int side, int margin) {
  const std::int64_t least = side + 2 * margin;
  if (amplitude.dim() != 3 || amplitude.size(1) < least || amplitude.size(2) < least)
    throw std::invalid_argument("expected chips of at least " + std::to_string(least) + " x " + std::to_string(least) +
                                " pixels, found " + (amplitude.dim() == 3 ? std::to_string(amplitude.size(1)) + " x " +
                                std::to_string(amplitude.size(2)) : "none"));
}

/// Mean 0 and standard deviation 1 of each chip.
torch::Tensor standardised(const torch::Tensor& chips) {
  const torch::Tensor centred = chips - chips.mean({1, 2}, true);
  return centred / centred.square().mean({1, 2}, true).sqrt().clamp_min(1e-12);
}

LabelledChips rows_of(const LabelledChips& chips, const torch::Tensor& index) {
  return {chips.amplitude.index_select(0, index), chips.label.index_select(0, index)};
}

}  // namespace

LabelledChips joined(const LabelledChips& a, const LabelledChips& b) {
  if (a.size() == 0) return b;
  if (b.size() == 0) return a;
  const bool posed = a.pose_deg.defined() && b.pose_deg.defined();
  return {torch::cat({a.amplitude, b.amplitude}), torch::cat({a.label, b.label}), posed ? torch::cat({a.pose_deg, b.pose_deg}) : torch::Tensor()};
}

torch::Tensor normalised_crops(const torch::Tensor& amplitude, int side, int row, int column) {
  require_room(amplitude, side, std::max(std::abs(row), std::abs(column)));
  const torch::Tensor crop = amplitude.narrow(1, (amplitude.size(1) - side) / 2 + row, side)
                                 .narrow(2, (amplitude.size(2) - side) / 2 + column, side);
  return standardised(crop.clamp_min(0.0).sqrt());
}

// Batches.

namespace {

/// Draws chips: first a class, then one of its chips.
class Deck {
 public:
  Deck(const LabelledChips& chips, int n_classes) : chips_(&chips) {
    for (int c = 0; c < n_classes; ++c) {
      const torch::Tensor members = torch::nonzero(chips.label == c).flatten();
      if (members.size(0) > 0) of_class_.push_back(members);
    }
  }

  LabelledChips draw(int n) const {
    std::vector<torch::Tensor> index;
    const torch::Tensor which = torch::randint(static_cast<std::int64_t>(of_class_.size()), {n}, torch::kInt64);
    for (int k = 0; k < n; ++k) {
      const torch::Tensor& members = of_class_[static_cast<std::size_t>(which[k].item<std::int64_t>())];
      index.push_back(members.index_select(0, torch::randint(members.size(0), {1}, torch::kInt64)));
    }
    return rows_of(*chips_, torch::cat(index));
  }

 private:
  const LabelledChips* chips_;
  std::vector<torch::Tensor> of_class_;
};

/// The chips of classes of which there is none in `present`.
LabelledChips without_classes_of(const LabelledChips& chips, const LabelledChips& present) {
  if (present.size() == 0) return chips;
  return rows_of(chips, torch::nonzero((chips.label.unsqueeze(1) == present.label.unsqueeze(0)).any(1).logical_not()).flatten());
}

/// Random crops and gains, [n, 1, side, side].
torch::Tensor disturbed(const torch::Tensor& amplitude, int side, const ClassifierOptions& o) {
  std::vector<torch::Tensor> crops;
  const torch::Tensor shift = torch::randint(-o.shift_pixels, o.shift_pixels + 1, {amplitude.size(0), 2}, torch::kInt64);
  for (std::int64_t n = 0; n < amplitude.size(0); ++n)
    crops.push_back(normalised_crops(amplitude.narrow(0, n, 1), side, shift[n][0].item<int>(), shift[n][1].item<int>()));
  const torch::Tensor gain = 1.0 + o.gain_jitter * (2.0 * torch::rand({amplitude.size(0), 1, 1}) - 1.0);
  return (torch::cat(crops) * gain).unsqueeze(1);
}

/// Share of the largest rate: up in the first three tenths, down by a cosine.
double rate_at(double progress) {
  constexpr double kRise = 0.3;
  if (progress < kRise) return progress / kRise;
  return 0.5 * (1.0 + std::cos(std::numbers::pi * (progress - kRise) / (1.0 - kRise)));
}

torch::Tensor network_scores(Classifier classifier, const TrainingChips& training, const torch::Tensor& test_amplitude, int n_classes,
                             const ClassifierOptions& o, const ProgressReport& report) {
  const int side = crop_pixels(classifier);
  require_room(training.shots.amplitude, side, o.shift_pixels);
  torch::manual_seed(o.seed);
  torch::nn::Sequential net = classifier == Classifier::resnet50  ? resnet50(n_classes)
                              : classifier == Classifier::texture ? texture_network(n_classes)
                                                                  : a_convnet(n_classes);
  net->to(o.device);
  torch::optim::AdamW optimiser(net->parameters(), torch::optim::AdamWOptions(o.rate).weight_decay(o.weight_decay));
  const Deck shots(training.shots, n_classes);
  const bool has_generated = training.generated.size() > 0;
  const LabelledChips others = joined(training.generated, without_classes_of(training.shots, training.generated));
  const Deck generated(others, n_classes);
  const int n_shots = has_generated ? static_cast<int>(std::lround(o.shot_fraction * o.batch)) : o.batch;

  net->train();
  for (int step = 0; step < o.n_steps; ++step) {
    LabelledChips batch = n_shots > 0 ? shots.draw(n_shots) : generated.draw(o.batch);
    if (n_shots > 0 && n_shots < o.batch) batch = joined(batch, generated.draw(o.batch - n_shots));
    for (auto& group : optimiser.param_groups()) group.options().set_lr(o.rate * rate_at((step + 0.5) / o.n_steps));
    optimiser.zero_grad();
    const torch::Tensor scores = net->forward(disturbed(batch.amplitude, side, o).to(o.device));
    torch::cross_entropy_loss(scores, batch.label.to(o.device), {}, at::Reduction::Mean, -100, o.label_smoothing).backward();
    optimiser.step();
    if (report) report(step + 1, o.n_steps);
  }

  net->eval();
  const torch::NoGradGuard guard;
  std::vector<torch::Tensor> scores;
  for (const torch::Tensor& part : test_amplitude.split(kPart))
    scores.push_back(torch::log_softmax(net->forward(normalised_crops(part, side).unsqueeze(1).to(o.device)), 1).cpu());
  const torch::Tensor all = torch::cat(scores);
  if (!torch::isfinite(all).all().item<bool>()) throw NumericsError("the network diverged: its scores are not finite; choose a lower rate");
  return all;
}

}  // namespace

// Classifiers without a network.

namespace {

constexpr double kBlur_pixels = 1.5;

torch::Tensor blurred(const torch::Tensor& chips) {
  const auto reach = static_cast<std::int64_t>(std::ceil(3.0 * kBlur_pixels));
  const torch::Tensor d = torch::arange(-reach, reach + 1, torch::kFloat32);
  torch::Tensor taps = torch::exp(-d.square() / (2.0 * kBlur_pixels * kBlur_pixels));
  taps = taps / taps.sum();
  const torch::Tensor rows = torch::conv2d(chips.unsqueeze(1), taps.view({1, 1, -1, 1}), {}, 1, torch::IntArrayRef{reach, 0});
  return torch::conv2d(rows, taps.view({1, 1, 1, -1}), {}, 1, torch::IntArrayRef{0, reach}).squeeze(1);
}

/// Blurred square roots of amplitude, of unit length, so that products are correlations.
torch::Tensor templates(const torch::Tensor& amplitude) {
  const int side = crop_pixels(Classifier::nearest_neighbour);
  require_room(amplitude, side, 0);
  std::vector<torch::Tensor> all;
  for (const torch::Tensor& part : amplitude.split(kPart)) {
    const torch::Tensor root = blurred(part.clamp_min(0.0).sqrt());
    all.push_back(standardised(root.narrow(1, (root.size(1) - side) / 2, side).narrow(2, (root.size(2) - side) / 2, side)).flatten(1) / side);
  }
  return torch::cat(all);
}

torch::Tensor nearest_scores(const LabelledChips& training, const torch::Tensor& test_amplitude, int n_classes) {
  const torch::NoGradGuard guard;
  const torch::Tensor known = templates(training.amplitude), correlation = templates(test_amplitude).mm(known.t());
  torch::Tensor scores = torch::full({test_amplitude.size(0), n_classes}, -2.0f);
  for (int c = 0; c < n_classes; ++c) {
    const torch::Tensor members = torch::nonzero(training.label == c).flatten();
    if (members.size(0) > 0) scores.select(1, c).copy_(std::get<0>(correlation.index_select(1, members).max(1)));
  }
  return scores;
}

/// Means, standard deviations, correlations of neighbours, and maxima of the four corners of 24 × 24 pixels of the square.
torch::Tensor corner_features(const torch::Tensor& amplitude) {
  constexpr int kCorner = 24;
  const torch::Tensor chips = normalised_crops(amplitude, crop_pixels(Classifier::background));
  std::vector<torch::Tensor> features;
  for (const torch::Tensor& corner : corners_of(chips, kCorner)) {
    const torch::Tensor centred = corner - corner.mean({1, 2}, true);
    const auto product = [&](int axis) {
      return (centred.narrow(axis, 0, kCorner - 1) * centred.narrow(axis, 1, kCorner - 1)).mean({1, 2});
    };
    const torch::Tensor variance = centred.square().mean({1, 2});
    features.insert(features.end(), {corner.mean({1, 2}), variance.sqrt(), product(1) / variance.clamp_min(1e-12),
                                     product(2) / variance.clamp_min(1e-12), std::get<0>(corner.flatten(1).max(1))});
  }
  return torch::stack(features, 1);
}

torch::Tensor background_scores(const LabelledChips& training, const torch::Tensor& test_amplitude, int n_classes) {
  constexpr double kWeightDecay = 1e-2;  // of normalised features
  constexpr int kSteps = 50;
  torch::Tensor known = corner_features(training.amplitude), asked = corner_features(test_amplitude);
  const torch::Tensor mean = known.mean(0), deviation = known.std(0, false).clamp_min(1e-6);
  known = (known - mean) / deviation;
  asked = (asked - mean) / deviation;
  torch::Tensor weight = torch::zeros({known.size(1), n_classes}, torch::requires_grad()),
                bias = torch::zeros({n_classes}, torch::requires_grad());
  torch::optim::LBFGS optimiser({weight, bias}, torch::optim::LBFGSOptions(1.0).max_iter(kSteps).line_search_fn("strong_wolfe"));
  optimiser.step([&] {
    optimiser.zero_grad();
    const torch::Tensor loss = torch::cross_entropy_loss(known.mm(weight) + bias, training.label) +
                               kWeightDecay * weight.square().sum();
    loss.backward();
    return loss;
  });
  const torch::NoGradGuard guard;
  return torch::log_softmax(asked.mm(weight) + bias, 1);
}

}  // namespace

torch::Tensor classify(Classifier classifier, const TrainingChips& training, const torch::Tensor& test_amplitude, int n_classes,
                       const ClassifierOptions& options, const ProgressReport& report) {
  const LabelledChips all = joined(training.shots, training.generated);
  if (all.size() == 0 || !has_labels_of(all, n_classes))
    throw std::invalid_argument("expected chips of classes 0 to " + std::to_string(n_classes - 1));
  switch (classifier) {
    case Classifier::nearest_neighbour: return nearest_scores(all, test_amplitude, n_classes);
    case Classifier::background: return background_scores(all, test_amplitude, n_classes);
    default: return network_scores(classifier, training, test_amplitude, n_classes, options, report);
  }
}

}  // namespace sarnerf
