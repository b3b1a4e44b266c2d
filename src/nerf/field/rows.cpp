// SPDX-License-Identifier: Apache-2.0
#include "field/rows.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sarnerf/mpa/integrate.h"

namespace sarnerf {

namespace {

using Row = AzimuthRows::Row;

/// Calls visit(ray, first segment, end segment) for the rays of a row.
template <class Visit>
void for_each_ray(const RowPart& part, const Row& row, Visit&& visit) {
  const std::vector<std::uint32_t>& ray_begin = part.rows.batch().ray_begin;
  for (std::size_t ray = row.first_ray; ray < row.end_ray; ++ray) visit(ray, ray_begin[ray], ray_begin[ray + 1]);
}

double transmittance(const RowPart& part, std::size_t begin, std::size_t end) {
  double depth = 0.0;
  for (std::size_t s = begin; s < end; ++s)
    depth += 2.0 * double{part.rows.field().extinction_per_m[s]} * double{part.rows.batch().length_m[s]};
  return std::exp(-depth);
}

/// Calls visit(bin, ray, weight) for the terms of S_j; the ray is one of the fan or the next one beyond it on either side.
template <class Visit>
void for_each_part_of_bins(const GroundBins& bins, const Fan& fan, Visit&& visit) {
  constexpr int kPlaces = 3;
  const auto n = static_cast<int>(bins.angle_rad.size());
  for (int j = 0; j < n; ++j) {
    const double here = bins.angle_rad[static_cast<std::size_t>(j)];
    if (std::isnan(here)) continue;
    // The last bin takes the angle step from the previous bin, which is nearly the same.
    const int other = j + 1 < n ? j + 1 : j - 1;
    double step = other >= 0 ? (bins.angle_rad[static_cast<std::size_t>(other)] - here) * (other - j) : 0.0;
    if (std::isnan(step)) step = 0.0;
    for (int p = 0; p < kPlaces; ++p) {
      const double angle = here + ((p + 0.5) / kPlaces - 0.5) * step;
      const double place = std::clamp((angle - fan.ray_angle_rad(0)) / fan.step_rad, -1.0, double(fan.n_elevation));
      const int k = std::min(static_cast<int>(std::floor(place)), fan.n_elevation - 1);
      visit(j, k, (1.0 - (place - k)) / kPlaces);
      visit(j, k + 1, (place - k) / kPlaces);
    }
  }
}

/// Adds the ground's image to a row's pixels: what a shadow takes away of it, attenuated by S_j, and its noise. S_j is the
/// transmittance T at the angle at which bin j sees the ground: linear between the rays of the fan, mean of three positions
/// in the bin. Rays that were not cast, because they miss all occupied voxels, have T = 1.
void add_ground(const RowPart& part, const Row& row, const LevelGround& ground, std::span<float> pixels) {
  const GroundBins bins = ground_bins(ground, row.acquisition, row.row);
  // One extra ray on either side of the fan, with T = 1.
  std::vector<double> to_ground(static_cast<std::size_t>(row.fan.n_elevation) + 2, 1.0);
  for_each_ray(part, row, [&](std::size_t ray, std::size_t begin, std::size_t end) {
    to_ground[part.rows.batch().ray_elevation[ray] + 1] += (transmittance(part, begin, end) - 1.0) / row.n_slices;
  });
  if (row.fan.n_elevation == 0) {
    for (std::size_t j = 0; j < pixels.size(); ++j) pixels[j] += bins.power[j];
    return;
  }
  for_each_part_of_bins(bins, row.fan, [&](int j, int k, double weight) {
    const auto bin = static_cast<std::size_t>(j);
    const double shaded = bins.shaded(bin), steady = double{bins.power[bin]} - shaded;
    pixels[bin] += static_cast<float>(weight * (steady + to_ground[static_cast<std::size_t>(k + 1)] * shaded));
  });
}

/// Adjoint of add_ground(): adds ∂L/∂κ of the row's segments, from ∂L/∂pixel, to part.d_extinction.
void add_ground_adjoint(RowPart& part, const Row& row, const LevelGround& ground,
                        std::span<const float> pixel_gradients) {
  if (row.fan.n_elevation == 0) return;
  const GroundBins bins = ground_bins(ground, row.acquisition, row.row);
  std::vector<double> gradient(static_cast<std::size_t>(row.fan.n_elevation) + 2, 0.0);
  for_each_part_of_bins(bins, row.fan, [&](int j, int k, double weight) {
    const auto bin = static_cast<std::size_t>(j);
    gradient[static_cast<std::size_t>(k + 1)] += weight * bins.shaded(bin) * double{pixel_gradients[bin]};
  });
  for_each_ray(part, row, [&](std::size_t ray, std::size_t begin, std::size_t end) {
    const double g = gradient[part.rows.batch().ray_elevation[ray] + 1];
    if (g == 0.0 || begin == end) return;
    const double by_depth = -g * transmittance(part, begin, end) / row.n_slices;
    for (std::size_t s = begin; s < end; ++s)
      part.d_extinction[s] += static_cast<float>(2.0 * double{part.rows.batch().length_m[s]} * by_depth);
  });
}

/// Calls visit(row, its pixels) for the rows of a part.
template <class T, class Visit>
void for_each_row(const RowPart& part, std::span<T> pixels, Visit&& visit) {
  for (const Row& row : part.rows.rows()) {
    const auto n_range = static_cast<std::size_t>(row.acquisition.n_range);
    visit(row, pixels.first(n_range));
    pixels = pixels.subspan(n_range);
  }
}

}  // namespace

std::size_t n_row_parts(std::size_t n_rows) {
  return std::max<std::size_t>(1, std::min(n_rows, static_cast<std::size_t>(thread_count())));
}

void render_part(RowPart& part, SourceBasis basis, Integrator integrator, const RaySampling& sampling,
                 const LevelGround* ground, std::span<float> pixels) {
  for_each_row(part, pixels, [&](const Row& row, std::span<float> out) {
    part.of_bin.assign(out.size(), 0.0);
    part.rows.integrate(row, basis, integrator, sampling.deposit, part.of_bin);
    if (part.rows.has_bounce()) part.rows.integrate(row, basis, integrator, sampling.deposit, part.of_bin, Path::by_ground);
    for (std::size_t j = 0; j < out.size(); ++j) {
      out[j] = static_cast<float>(part.of_bin[j] * beta0_per_contribution(row.acquisition, row.fan.step_rad, row.n_slices,
                                                                          static_cast<int>(j)));
    }
    if (ground != nullptr) add_ground(part, row, *ground, out);
  });
}

void render_part_adjoint(RowPart& part, SourceBasis basis, Integrator integrator, const RaySampling& sampling,
                         const LevelGround* ground, std::span<const float> pixel_gradients) {
  part.d_extinction.assign(part.rows.n_segments(), 0.0f);
  part.d_source.assign(part.rows.n_segments(), 0.0f);
  const bool bounce = part.rows.has_bounce();
  part.d_bounce.assign(bounce ? part.rows.n_segments() : 0, 0.0f);
  part.d_bounce_extinction.assign(part.d_bounce.size(), 0.0f);
  for_each_row(part, pixel_gradients, [&](const Row& row, std::span<const float> gradients) {
    part.of_bin.resize(gradients.size());
    for (std::size_t j = 0; j < gradients.size(); ++j) {
      part.of_bin[j] = double{gradients[j]} * beta0_per_contribution(row.acquisition, row.fan.step_rad, row.n_slices,
                                                                     static_cast<int>(j));
    }
    part.rows.integrate_adjoint(row, basis, integrator, sampling.deposit, part.of_bin,
                                {part.d_extinction, {}, part.d_source});
    if (bounce) {
      part.rows.integrate_adjoint(row, basis, integrator, sampling.deposit, part.of_bin,
                                  {part.d_bounce_extinction, {}, part.d_bounce}, Path::by_ground);
      for (std::uint32_t s = part.rows.first_segment(row); s < part.rows.end_segment(row); ++s)
        part.d_extinction[s] += part.d_bounce_extinction[s];
    }
    if (ground != nullptr) add_ground_adjoint(part, row, *ground, gradients);
  });
}

}  // namespace sarnerf
