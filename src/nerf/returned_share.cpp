// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/returned_share.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/gaussian_blur.h"

namespace sarnerf {
namespace {

constexpr double kLeast = 0.5, kMost = 2.0;

/// Multiples of the ground's brightness between which a pixel's weight rises from 0 to 1.
constexpr float kBrightFrom = 2.0f, kBright = 4.0f;
constexpr double kBlur_pixels = 1.0;

/// Of relative amplitude residuals: their floor over the ground's brightness, their blur, and the bounds beyond which the field
/// has missed a scatterer rather than its brightness.
constexpr double kFloor = 0.2, kResidualBlur_pixels = 0.7;
constexpr float kLeastResidual = -1.0f, kMostResidual = 3.0f;

/// Excess variance from which single glints make up the targets' power. Simulated targets have 0.003 to 0.03, four measured
/// ones 0.16 to 0.27, which one factor for all directions makes 1 dB worse (docs/training.md).
constexpr double kGlints = 0.1;

/// Weights of pixels that are brighter than the ground.
Image<float> bright_target_weight(const Image<float>& power, double ground_power) {
  Image<float> weight = gaussian_blur(power, kBlur_pixels);
  for (float& w : weight.pixels())
    w = std::clamp((w / static_cast<float>(ground_power) - kBrightFrom) / (kBright - kBrightFrom), 0.0f, 1.0f);
  return weight;
}

/// √((I + f) / (μ + f)) − 1, blurred.
Image<float> amplitude_residual(const Image<float>& image, const Image<float>& predicted, float floor) {
  Image<float> residual(image.n_azimuth(), image.n_range());
  for (std::size_t n = 0; n < residual.pixels().size(); ++n) {
    const float ratio = (image.pixels()[n] + floor) / (std::max(predicted.pixels()[n], 0.0f) + floor);
    residual.pixels()[n] = std::clamp(std::sqrt(ratio) - 1.0f, kLeastResidual, kMostResidual);
  }
  return gaussian_blur(residual, kResidualBlur_pixels);
}

/// Weighted sums of residuals.
struct Moments {
  double weight = 0.0, sum = 0.0, squares = 0.0;

  void add(double w, double r) {
    weight += w;
    sum += w * r;
    squares += w * r * r;
  }
  double mean() const { return weight > 0.0 ? sum / weight : 0.0; }
  double variance_about(double centre) const {
    return weight > 0.0 ? (squares - 2.0 * centre * sum) / weight + centre * centre : 0.0;
  }
};

}  // namespace

double returned_share(GridField& field, const TrainingSet& set) {
  if (!set.clutter) return 1.0;
  const double ground_power = set.clutter->ground->mean_power(), scale = field.source_scale();
  const auto floor = static_cast<float>(kFloor * ground_power);
  double missing = 0.0, returned = 0.0;
  Moments of_targets, of_ground;
  for (const PosedImage& image : set.images) {
    const Image<float> whole = render_view(field, image.acquisition);
    field.set_source_scale(0.0);
    const Image<float> ground = render_view(field, image.acquisition);
    field.set_source_scale(scale);
    const Image<float> weight = bright_target_weight(whole, ground_power);
    const Image<float> residual = amplitude_residual(image.power, whole, floor);
    for (std::size_t n = 0; n < weight.pixels().size(); ++n) {
      const double w = double{weight.pixels()[n]}, predicted = double{whole.pixels()[n]};
      missing += w * (double{image.power.pixels()[n]} - predicted);
      returned += w * (predicted - double{ground.pixels()[n]});
      of_targets.add(w, double{residual.pixels()[n]});
      of_ground.add(1.0 - w, double{residual.pixels()[n]});
    }
  }
  // Under speckle the mean amplitude is below that of steady power: the ground says by how much.
  const double centre = of_ground.mean();
  const double excess_variance = of_targets.variance_about(centre) - of_ground.variance_about(centre);
  if (!(returned > 0.0) || excess_variance >= kGlints) return 1.0;
  return std::clamp(1.0 + missing / returned, kLeast, kMost);
}

}  // namespace sarnerf
