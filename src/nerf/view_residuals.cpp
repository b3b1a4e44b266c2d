// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/view_residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sarnerf/core/gaussian_blur.h"
#include "sarnerf/core/units.h"
#include "sarnerf/dataset/view_interpolation.h"

namespace sarnerf {
namespace {

constexpr std::size_t kLeastViews = 6, kNearest = 6;
constexpr double kBlur_pixels = 0.7;

/// Of the ground's brightness, as `speckle_floor` is by default.
constexpr double kFloor = 0.2;

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

PosedImage residual_of(const LearnedField& field, const PosedImage& image, double floor) {
  PosedImage residual{image.name, image.acquisition, render_view(field, image.acquisition)};
  for (std::size_t n = 0; n < residual.power.pixels().size(); ++n) {
    float& r = residual.power.pixels()[n];
    r = (image.power.pixels()[n] - r) / (std::max(r, 0.0f) + static_cast<float>(floor));
  }
  residual.power = gaussian_blur(residual.power, kBlur_pixels);
  for (float& r : residual.power.pixels()) r = std::clamp(r, kLeastResidual, kMostResidual);
  return residual;
}

double product(const Image<float>& a, const Image<float>& b) {
  double sum = 0.0;
  for (std::size_t n = 0; n < a.pixels().size(); ++n) sum += double{a.pixels()[n]} * double{b.pixels()[n]};
  return sum;
}

/// Two views' residuals: how far apart, their product, and what that would be if they were equal.
struct Pair {
  double angle_rad, product, energy;
};

std::vector<Pair> pairs_of(const ViewResiduals& residuals) {
  std::vector<Pair> pairs;
  for (std::size_t v = 0; v < residuals.views.size(); ++v) {
    const PosedImage& view = residuals.views[v];
    const double own = product(view.power, view.power);
    for (const std::size_t other : nearest(residuals.views, view.acquisition, v)) {
      const Image<float> image = turned(residuals.views[other], view.acquisition, residuals.plane_height_m);
      pairs.push_back({angle_between(view.acquisition, residuals.views[other].acquisition), product(image, view.power),
                       std::sqrt(product(image, image) * own)});
    }
  }
  return pairs;
}

/// The least squares fit of s exp(−Δ/L).
void fit(ViewResiduals& residuals) {
  const std::vector<Pair> pairs = pairs_of(residuals);
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

std::vector<double> ViewResiduals::weights(std::span<const std::size_t> near, const Acquisition& wanted) const {
  const auto covariance = [&](const Acquisition& a, const Acquisition& b) {
    return share * std::exp(-angle_between(a, b) / length_rad);
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
  const std::vector<double> w = weights(near, centred);
  Image<float> expected(power.n_azimuth(), power.n_range());
  for (std::size_t k = 0; k < near.size(); ++k) {
    const Image<float> image = turned(views[near[k]], centred, plane_height_m);
    for (std::size_t n = 0; n < expected.pixels().size(); ++n)
      expected.pixels()[n] += static_cast<float>(w[k]) * image.pixels()[n];
  }
  for (std::size_t n = 0; n < expected.pixels().size(); ++n) {
    float& p = power.pixels()[n];
    p = std::max(0.0f, p + (std::max(p, 0.0f) + static_cast<float>(floor)) * expected.pixels()[n]);
  }
}

std::optional<ViewResiduals> find_residuals(const LearnedField& field, const TrainingSet& set) {
  if (!set.clutter || set.images.size() < kLeastViews) return {};
  ViewResiduals residuals;
  residuals.floor = kFloor * set.clutter->ground->mean_power();
  residuals.plane_height_m = set.clutter->ground->height_m;
  for (const PosedImage& image : set.images) residuals.views.push_back(residual_of(field, image, residuals.floor));
  fit(residuals);
  if (residuals.share < kLeastShare) return {};
  return residuals;
}

}  // namespace sarnerf
