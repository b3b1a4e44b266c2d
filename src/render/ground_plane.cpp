// SPDX-License-Identifier: Apache-2.0
#include "ground_plane.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/units.h"

namespace sarnerf {
namespace {

/// The mesh wins over a ground that lies above it by less than this part of a bin, and what single precision
/// makes of the scene's coordinates: floors and roads lie in the ground's plane.
constexpr double kCoplanarInBins = 1.0 / 300.0;
constexpr double kSinglePrecision = 0x1p-21;

/// Largest coordinate of a view's rays, in the frame in which they are traced (m).
double reach_m(const ViewRays& rays) {
  const Acquisition& a = rays.grid.acquisition();
  const auto at = [&](std::size_t n) {
    return glm::length(glm::dvec3(rays.origin_x[n], rays.origin_y[n], rays.origin_z[n]));
  };
  return std::max(at(0), at(rays.origin_x.size() - 1)) + 0.5 * a.n_azimuth * a.azimuth_spacing_m +
         static_cast<double>(rays.far_m);
}

}  // namespace

GroundPlane::GroundPlane(const ViewRays& rays, const Appearance& appearance, double height_m)
    : rays_(rays), appearance_(appearance) {
  const Acquisition& a = rays.grid.acquisition();
  const Fan& fan = rays.grid.fan();
  const double theta = a.incidence_rad, r = a.slant_range_m;
  const double above_ground_m = a.aim_m.y - height_m;  // of the aim point
  const double height_of_radar_m = a.altitude_m() + above_ground_m;

  const auto size = static_cast<std::size_t>(fan.n_elevation) + 2;
  const double coplanar_m = kCoplanarInBins * a.range_spacing_m + kSinglePrecision * reach_m(rays);
  bin_.assign(size, 0.0f);
  coplanar_bins_.assign(size, 0.0f);
  bin_per_ray_.assign(size, 0.0f);
  gamma_.assign(size, -1.0f);  // negative: this ray does not meet the plane
  for (int k = -1; k <= fan.n_elevation; ++k) {
    const double delta = fan.ray_angle_rad(k);
    const double incidence = theta + delta;
    const double cosine = std::cos(incidence);
    if (incidence <= 0.0 || cosine <= 1e-9) continue;
    // t − r = (H − r cos(θ + δ)) / cos(θ + δ), with the difference of cosines as a product.
    const double offset_m =
        (above_ground_m + 2.0 * r * std::sin(theta + 0.5 * delta) * std::sin(0.5 * delta)) / cosine;
    const std::size_t m = index(k);
    bin_[m] = static_cast<float>(rays.bin_coordinate(offset_m));
    bin_per_ray_[m] = static_cast<float>((r + offset_m) * std::tan(incidence) * fan.step_rad /
                                         a.range_spacing_m);
    coplanar_bins_[m] = static_cast<float>(coplanar_m / cosine / a.range_spacing_m);
    gamma_[m] = appearance_.brightness(static_cast<float>(cosine));
  }

  if (!uniform()) return;
  const auto angle_at_range = [&](double range_m) {
    return range_m <= height_of_radar_m ? 0.0 : std::acos(height_of_radar_m / range_m);
  };
  const auto gamma_at = [&](double incidence) {
    return static_cast<double>(appearance_.brightness(static_cast<float>(std::cos(incidence))));
  };
  double near_angle = angle_at_range(a.range_m(-0.5));
  border_ray_.push_back((near_angle - theta - fan.first_angle_rad) / fan.step_rad - 0.5);
  for (int j = 0; j < a.n_range; ++j) {
    const double far_angle = angle_at_range(a.range_m(j + 0.5));
    border_ray_.push_back((far_angle - theta - fan.first_angle_rad) / fan.step_rad - 0.5);
    // Simpson's rule over one bin.
    bin_gamma_.push_back((gamma_at(near_angle) + 4.0 * gamma_at(0.5 * (near_angle + far_angle)) +
                          gamma_at(far_angle)) / 6.0);
    near_angle = far_angle;
  }
}

void GroundPlane::put(Slice& slice, std::size_t m, int k) const {
  const std::size_t g = index(k);
  if (gamma_[g] < 0.0f) {
    slice.surface[m] = kNoTriangle;
    slice.gamma[m] = 0.0f;
    return;
  }
  slice.surface[m] = kGroundSurface;
  slice.bin[m] = bin_[g];
  slice.bin_per_ray[m] = bin_per_ray_[g];
  slice.bin_per_slice[m] = 0.0f;
  slice.gamma[m] = gamma_[g];
  if (appearance_.checker) {
    const Acquisition& a = rays_.grid.acquisition();
    const int inside = std::clamp(k, 0, rays_.grid.fan().n_elevation - 1);
    const double offset_m = (bin_[g] - 0.5 * a.n_range) * a.range_spacing_m;
    slice.gamma[m] *= appearance_.checker->factor(glm::vec3(rays_.scene_point(slice.along_m, offset_m, inside)));
  }
}

void GroundPlane::fill(Slice& slice) const {
  const auto last = static_cast<std::size_t>(slice.n_rays) + 1;
  put(slice, 0, slice.first - 1);
  put(slice, last, slice.first + slice.n_rays);
  for (std::size_t m = 1; m < last; ++m) {
    const int k = slice.first + static_cast<int>(m) - 1;
    const std::size_t g = index(k);
    const bool behind_mesh = slice.surface[m] != kNoTriangle &&
                             (gamma_[g] < 0.0f || bin_[g] > slice.bin[m] - coplanar_bins_[g]);
    if (!behind_mesh) put(slice, m, k);
  }
}

void GroundPlane::fill_alone(int first, int n, Slice& slice) const {
  slice.resize(n);
  slice.first = first;
  for (int m = 0; m <= n + 1; ++m) put(slice, static_cast<std::size_t>(m), first + m - 1);
}

void GroundPlane::deposit_outside(double gap_first, double gap_last, double weight,
                                  std::span<double> bins) const {
  const double first = std::min(gap_first, gap_last);
  for (std::size_t j = 0; j < bins.size(); ++j) {
    const double near = border_ray_[j], far = border_ray_[j + 1];
    const double hidden = std::max(0.0, std::min(far, gap_last) - std::max(near, first));
    bins[j] += weight * bin_gamma_[j] * std::max(0.0, far - near - hidden);
  }
}

}  // namespace sarnerf
