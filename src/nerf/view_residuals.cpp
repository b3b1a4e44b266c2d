// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/view_residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sarnerf/core/gaussian_blur.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/view_interpolation.h"
#include "shining.h"

namespace sarnerf {
namespace {

constexpr std::size_t kLeastViews = 6, kNearest = 6;
constexpr double kBlur_pixels = 0.7;

/// Of the ground's brightness.
constexpr double kFloor = 0.2;

/// How much of each other's speckle unseen views share, over what the residuals of trained views do.
constexpr double kLearned = 2.5;

/// Standard deviation (pixels) by which amplitudes are blurred, for each degree between the two nearest views, and at
/// most, where targets glint so strongly or more: what stands above the plane is turned to a place beside its own.
constexpr double kBlurPerDegree = 0.1, kMostBlur_pixels = 0.8, kGlints = 0.15;

/// Residuals beyond these say that the field has missed a place, not how bright it is.
constexpr float kLeastResidual = -1.0f, kMostResidual = 3.0f;

/// Shares below this gain nothing; shares above leave the weights' equations ill-conditioned.
constexpr double kLeastShare = 0.02, kMostShare = 0.9;

/// Lengths that are tried (degrees).
constexpr double kLengths_deg[] = {2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0};

double angle_between(const Acquisition& a, const Acquisition& b) {
  return std::acos(std::clamp(glm::dot(radar_frame(a).k, radar_frame(b).k), -1.0, 1.0));
}

/// Places of the views nearest to a line of sight, all but one of them.
std::vector<std::size_t> nearest(std::span<const PosedImage> views, const Acquisition& wanted, std::size_t but) {
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> angle;
  for (const PosedImage& view : views) angle.push_back(angle_between(view.acquisition, wanted));
  std::erase(order, but);
  const std::size_t n = std::min(order.size(), kNearest);
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n), order.end(),
                    [&](std::size_t a, std::size_t b) { return angle[a] != angle[b] ? angle[a] < angle[b] : a < b; });
  order.resize(n);
  return order;
}

Image<float> turned(const PosedImage& view, const Acquisition& wanted, double plane_height_m) {
  return interpolate_view({&view, 1}, wanted, Interpolation::rotated_linear, plane_height_m);
}

/// How far what shines does so in glints, whose residuals neighbouring views share: wholly, or little.
double glinting(const ViewResiduals& residuals) { return std::min(1.0, residuals.glints / kGlints); }

float floor_of(const ViewResiduals& residuals) { return static_cast<float>(kFloor * residuals.ground_power); }

Image<float> residual_of(const PosedImage& image, const Image<float>& rendered, float floor) {
  Image<float> residual(rendered.n_azimuth(), rendered.n_range());
  for (std::size_t n = 0; n < residual.pixels().size(); ++n) {
    const float b = std::sqrt(std::max(rendered.pixels()[n], 0.0f) + floor);
    residual.pixels()[n] = std::clamp(std::sqrt(image.power.pixels()[n] + floor) / b - 1.0f, kLeastResidual, kMostResidual);
  }
  return gaussian_blur(residual, kBlur_pixels);
}

/// Σ weight a b.
double product(const Image<float>& a, const Image<float>& b, const Image<float>& weight) {
  double sum = 0.0;
  for (std::size_t n = 0; n < a.pixels().size(); ++n)
    sum += double{weight.pixels()[n]} * double{a.pixels()[n]} * double{b.pixels()[n]};
  return sum;
}

float mean_over(const ViewResiduals& residuals, std::span<const Image<float>> ground) {
  double sum = 0.0, weight = 0.0;
  for (std::size_t v = 0; v < ground.size(); ++v)
    for (std::size_t n = 0; n < ground[v].pixels().size(); ++n) {
      sum += double{ground[v].pixels()[n]} * double{residuals.views[v].power.pixels()[n]};
      weight += double{ground[v].pixels()[n]};
    }
  return weight > 0.0 ? static_cast<float>(sum / weight) : 0.0f;
}

void add(ViewResiduals& residuals, float value) {
  for (PosedImage& view : residuals.views)
    for (float& r : view.power.pixels()) r += value;
}

/// The mean square of the residuals, where it counts.
double variance(const ViewResiduals& residuals, std::span<const Image<float>> weight) {
  double sum = 0.0, count = 0.0;
  for (std::size_t v = 0; v < weight.size(); ++v) {
    sum += product(residuals.views[v].power, residuals.views[v].power, weight[v]);
    for (const float w : weight[v].pixels()) count += double{w};
  }
  return count > 0.0 ? sum / count : 0.0;
}

/// Two views' residuals: how far apart, their product, and what that would be if they were equal.
struct Pair {
  double angle_rad, product, energy;
};

std::vector<Pair> pairs_of(const ViewResiduals& residuals, std::span<const Image<float>> ground) {
  std::vector<Pair> pairs;
  for (std::size_t v = 0; v < residuals.views.size(); ++v) {
    const PosedImage& view = residuals.views[v];
    const double own = product(view.power, view.power, ground[v]);
    for (const std::size_t other : nearest(residuals.views, view.acquisition, v)) {
      const Image<float> image = turned(residuals.views[other], view.acquisition, residuals.plane_height_m);
      pairs.push_back({angle_between(view.acquisition, residuals.views[other].acquisition), product(image, view.power, ground[v]),
                       std::sqrt(product(image, image, ground[v]) * own)});
    }
  }
  return pairs;
}

/// The least squares fit of s exp(−Δ/L).
void fit(ViewResiduals& residuals, std::span<const Image<float>> ground) {
  const std::vector<Pair> pairs = pairs_of(residuals, ground);
  double least = std::numeric_limits<double>::infinity();
  for (const double length_deg : kLengths_deg) {
    const double length_rad = rad_from_deg(length_deg);
    double upper = 0.0, lower = 0.0, error = 0.0;
    for (const Pair& p : pairs) {
      const double e = p.energy * std::exp(-p.angle_rad / length_rad);
      upper += p.product * e;
      lower += e * e;
    }
    const double share = lower > 0.0 ? std::clamp(upper / lower, 0.0, kMostShare) : 0.0;
    for (const Pair& p : pairs) {
      const double e = p.product - share * p.energy * std::exp(-p.angle_rad / length_rad);
      error += e * e;
    }
    if (error >= least) continue;
    least = error;
    residuals.share = share;
    residuals.length_rad = length_rad;
  }
}

}  // namespace

std::vector<double> ViewResiduals::weights(std::span<const std::size_t> near, const Acquisition& wanted,
                                           double share_of_it) const {
  const auto covariance = [&](const Acquisition& a, const Acquisition& b) {
    return share_of_it * std::exp(-angle_between(a, b) / length_rad);
  };
  const std::size_t n = near.size();
  std::vector<double> among(n * n), with_wanted(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Acquisition& own = views[near[i]].acquisition;
    with_wanted[i] = covariance(own, wanted);
    for (std::size_t j = 0; j < n; ++j) among[i * n + j] = covariance(own, views[near[j]].acquisition);
  }
  // Gauss and Seidel: the matrix is positive definite, with a diagonal of 1.
  constexpr int kRounds = 200;
  std::vector<double> w(n, 0.0);
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t i = 0; i < n; ++i) {
      double value = with_wanted[i];
      for (std::size_t j = 0; j < n; ++j)
        if (j != i) value -= among[i * n + j] * w[j];
      w[i] = value;
    }
  return w;
}

void ViewResiduals::correct(Image<float>& power, const Acquisition& wanted) const {
  Acquisition centred = wanted;
  centred.aim_m = glm::dvec3(0.0);
  const std::vector<std::size_t> near = nearest(views, centred, views.size());
  const std::vector<double> on_ground = weights(near, centred, share), on_target = weights(near, centred, target_share);
  const Image<float> shines = shining(power, ground_power);
  Image<float> expected(power.n_azimuth(), power.n_range());
  for (std::size_t k = 0; k < near.size(); ++k) {
    const Image<float> image = turned(views[near[k]], centred, plane_height_m);
    const auto w = static_cast<float>(on_ground[k]), more = static_cast<float>(on_target[k] - on_ground[k]);
    for (std::size_t n = 0; n < expected.pixels().size(); ++n)
      expected.pixels()[n] += (w + more * shines.pixels()[n]) * image.pixels()[n];
  }
  const float floor = floor_of(*this);
  const auto mean = static_cast<float>(ground_mean * std::accumulate(on_target.begin(), on_target.end(), 0.0));
  for (std::size_t n = 0; n < expected.pixels().size(); ++n) {
    float& p = power.pixels()[n];
    const float factor = std::max(0.0f, 1.0f + expected.pixels()[n] - mean * shines.pixels()[n]);
    p = std::sqrt(std::max(0.0f, (std::max(p, 0.0f) + floor) * factor * factor - floor));
  }
  double between_rad = 0.0;
  for (std::size_t k = 0; k < std::min<std::size_t>(2, near.size()); ++k)
    between_rad += angle_between(views[near[k]].acquisition, centred);
  power = gaussian_blur(power, glinting(*this) * std::min(kMostBlur_pixels, kBlurPerDegree * deg_from_rad(between_rad)));
  for (float& p : power.pixels()) p *= p;
}

std::optional<ViewResiduals> find_residuals(const LearnedField& field, const TrainingSet& set) {
  if (!set.clutter || set.images.size() < kLeastViews) return {};
  ViewResiduals residuals;
  residuals.ground_power = set.clutter->ground->mean_power();
  residuals.plane_height_m = set.clutter->ground->height_m;
  if (!(residuals.ground_power > 0.0)) return {};
  std::vector<Image<float>> ground, targets;
  for (const PosedImage& image : set.images) {
    const Image<float> rendered = render_view(field, image.acquisition);
    residuals.views.push_back({image.name, image.acquisition, residual_of(image, rendered, floor_of(residuals))});
    targets.push_back(shining(rendered, residuals.ground_power));
    ground.push_back(targets.back());
    for (float& part : ground.back().pixels()) part = 1.0f - part;
  }
  // Of amplitude, speckle has less than steady power has: that is no likeness between views.
  const float mean = mean_over(residuals, ground);
  add(residuals, -mean);
  fit(residuals, ground);
  const double of_ground = variance(residuals, ground), of_targets = variance(residuals, targets);
  residuals.glints = std::max(0.0, of_targets - of_ground);
  if (of_targets > 0.0)
    residuals.target_share = glinting(residuals) * std::min(kMostShare, residuals.glints / of_targets);
  add(residuals, mean);
  residuals.ground_mean = double{mean};
  residuals.share = residuals.share < kLeastShare ? 0.0 : std::min(kMostShare, kLearned * residuals.share);
  return residuals;
}

}  // namespace sarnerf
