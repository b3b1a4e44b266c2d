// SPDX-License-Identifier: Apache-2.0
#include "row_ground.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sarnerf {
namespace {

/// Calls visit(ray, first segment, end segment) for the rays of a row.
template <class Visit>
void for_each_ray(const RowPart& part, const RowPart::Row& row, Visit&& visit) {
  for (std::size_t ray = row.first_ray; ray < row.end_ray; ++ray)
    visit(ray, part.batch.ray_begin[ray], part.batch.ray_begin[ray + 1]);
}

double transmittance(const RowPart& part, std::size_t begin, std::size_t end) {
  double depth = 0.0;
  for (std::size_t s = begin; s < end; ++s)
    depth += 2.0 * double{part.field.extinction_per_m[s]} * double{part.batch.length_m[s]};
  return std::exp(-depth);
}

/// Calls visit(bin, ray of the fan or one beside it, weight) for what S_j is made of.
template <class Visit>
void for_each_part_of_bins(const GroundBins& bins, const Fan& fan, Visit&& visit) {
  constexpr int kPlaces = 3;
  const auto n = static_cast<int>(bins.angle_rad.size());
  for (int j = 0; j < n; ++j) {
    const double here = bins.angle_rad[static_cast<std::size_t>(j)];
    if (std::isnan(here)) continue;
    // Angles grow by nearly as much from the bin before as to the next one.
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

}  // namespace

void add_ground(const RowPart& part, const RowPart::Row& row, const LevelGround& ground, const RaySampling& sampling,
                std::span<float> pixels) {
  const GroundBins bins = ground_bins(ground, row.acquisition, row.row);
  // One more ray on either side of the fan, that meets nothing.
  std::vector<double> to_ground(static_cast<std::size_t>(row.fan.n_elevation) + 2, 1.0);
  for_each_ray(part, row, [&](std::size_t ray, std::size_t begin, std::size_t end) {
    to_ground[part.ray_k[ray] + 1] += (transmittance(part, begin, end) - 1.0) / sampling.sub_rows;
  });
  if (row.fan.n_elevation == 0) {
    for (std::size_t j = 0; j < pixels.size(); ++j) pixels[j] += bins.power[j];
    return;
  }
  for_each_part_of_bins(bins, row.fan, [&](int j, int k, double weight) {
    pixels[static_cast<std::size_t>(j)] +=
        static_cast<float>(weight * to_ground[static_cast<std::size_t>(k + 1)] * double{bins.power[static_cast<std::size_t>(j)]});
  });
}

void add_ground_adjoint(RowPart& part, const RowPart::Row& row, const LevelGround& ground, const RaySampling& sampling,
                        std::span<const float> pixel_gradients) {
  if (row.fan.n_elevation == 0) return;
  const GroundBins bins = ground_bins(ground, row.acquisition, row.row);
  std::vector<double> gradient(static_cast<std::size_t>(row.fan.n_elevation) + 2, 0.0);
  for_each_part_of_bins(bins, row.fan, [&](int j, int k, double weight) {
    const auto bin = static_cast<std::size_t>(j);
    gradient[static_cast<std::size_t>(k + 1)] += weight * double{bins.power[bin]} * double{pixel_gradients[bin]};
  });
  for_each_ray(part, row, [&](std::size_t ray, std::size_t begin, std::size_t end) {
    const double g = gradient[part.ray_k[ray] + 1];
    if (g == 0.0 || begin == end) return;
    const double by_depth = -g * transmittance(part, begin, end) / sampling.sub_rows;
    for (std::size_t s = begin; s < end; ++s)
      part.d_extinction[s] += static_cast<float>(2.0 * double{part.batch.length_m[s]} * by_depth);
  });
}

}  // namespace sarnerf
