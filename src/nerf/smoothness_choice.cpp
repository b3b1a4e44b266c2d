// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/smoothness_choice.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

constexpr double kFactor = 3.0;
constexpr int kFarthest = 3;  ///< powers of the factor, either way
constexpr std::size_t kHeldOutOf = 6;

struct Parts {
  TrainingSet learned;
  std::vector<PosedImage> held_out;
};

/// Every sixth view in the order of azimuth, so that each pitch loses some.
Parts parts_of(const TrainingSet& set) {
  std::vector<std::size_t> order(set.images.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto azimuth = [&](std::size_t v) { return set.images[v].acquisition.azimuth_rad; };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return azimuth(a) < azimuth(b); });
  Parts parts;
  TrainingSet& learned = parts.learned;
  learned = set;
  learned.images.clear();
  learned.cleaned.clear();
  if (learned.clutter) {
    learned.clutter->gain.clear();
    learned.clutter->like_ground.clear();
  }
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::size_t v = order[n];
    if (n % kHeldOutOf == kHeldOutOf / 2) {
      parts.held_out.push_back(set.images[v]);
      continue;
    }
    learned.images.push_back(set.images[v]);
    if (!set.cleaned.empty()) learned.cleaned.push_back(set.cleaned[v]);
    if (!set.clutter) continue;
    learned.clutter->gain.push_back(set.clutter->gain[v]);
    learned.clutter->like_ground.push_back(set.clutter->like_ground[v]);
  }
  return parts;
}

double deviance(double seen, double predicted) {
  const double ratio = seen / predicted;
  return ratio - 1.0 - std::log(ratio);
}

double loss_of(const LearnedField& field, const Parts& parts, const TrainerOptions& options) {
  const TrainingSet& set = parts.learned;
  const bool speckled = set.clutter && set.clutter->speckled && options.speckle_floor > 0.0;
  const double floor = speckled ? options.speckle_floor * set.clutter->ground->mean_power() : 0.0;
  double total = 0.0;
  std::size_t n = 0;
  for (const PosedImage& image : parts.held_out) {
    const Image<float> predicted = render_view(field, image.acquisition);
    for (std::size_t p = 0; p < predicted.pixels().size(); ++p, ++n) {
      const double seen = double{image.power.pixels()[p]}, mean = std::max(0.0, double{predicted.pixels()[p]});
      const double error = (mean - seen) / double{set.peak};
      total += speckled ? deviance(seen + floor, mean + floor) : error * error;
    }
  }
  return total / static_cast<double>(std::max<std::size_t>(1, n));
}

}  // namespace

TrainerOptions with_smoothness(TrainerOptions options, double factor) {
  options.grid.smooth_density *= factor;
  options.grid.smooth_source *= factor;
  options.grid.smooth_angular *= factor;
  return options;
}

SmoothnessChoice choose_smoothness(const TrainingSet& set, const TrainerOptions& options, std::int64_t n_steps,
                                   const Monitor& monitor) {
  if (options.field != "grid")
    throw UsageError("smoothness is chosen for the field grid; the field " + options.field + " has no such weights");
  if (set.images.size() < kHeldOutOf)
    throw UsageError("to choose the smoothness by validation takes 6 views or more, found " + std::to_string(set.images.size()));
  const Parts parts = parts_of(set);
  const auto trial = [&](int power) {
    const double factor = std::pow(kFactor, power);
    Trainer trainer(parts.learned, with_smoothness(options, factor));
    for (std::int64_t n = 0; n < n_steps; ++n) {
      monitor.check();
      trainer.step(static_cast<double>(n) / static_cast<double>(n_steps));
      monitor.report("smoothness", static_cast<std::uint64_t>(n + 1), static_cast<std::uint64_t>(n_steps));
    }
    trainer.finish();
    return SmoothnessTrial{factor, loss_of(trainer.field(), parts, options)};
  };
  SmoothnessChoice choice;
  std::vector<SmoothnessTrial>& trials = choice.trials;
  for (int power = -1; power <= 1; ++power) trials.push_back(trial(power));
  const auto best = [&] {
    return std::min_element(trials.begin(), trials.end(), [](const auto& a, const auto& b) { return a.loss < b.loss; });
  };
  for (int power = 2; power <= kFarthest && best() == std::prev(trials.end()); ++power) trials.push_back(trial(power));
  for (int power = 2; power <= kFarthest && best() == trials.begin(); ++power) trials.insert(trials.begin(), trial(-power));
  choice.factor = best()->factor;
  return choice;
}

}  // namespace sarnerf
