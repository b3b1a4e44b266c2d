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

/// Adds to a row's pixels what its rays leave of the ground's image: S_j = T at the angle under which bin j sees the
/// ground, linear between the rays of the fan, of three places in the bin. Rays that were not made, since they miss all
/// matter, have T = 1.
void add_ground(const RowPart& part, const Row& row, const LevelGround& ground, std::span<float> pixels) {
  const GroundBins bins = ground_bins(ground, row.acquisition, row.row);
  // One more ray on either side of the fan, that meets nothing.
  std::vector<double> to_ground(static_cast<std::size_t>(row.fan.n_elevation) + 2, 1.0);
  for_each_ray(part, row, [&](std::size_t ray, std::size_t begin, std::size_t end) {
    to_ground[part.rows.batch().ray_elevation[ray] + 1] += (transmittance(part, begin, end) - 1.0) / row.n_slices;
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

/// Its adjoint: adds ∂L/∂κ of the row's segments, from ∂L/∂pixel, to part.d_extinction.
void add_ground_adjoint(RowPart& part, const Row& row, const LevelGround& ground,
                        std::span<const float> pixel_gradients) {
  if (row.fan.n_elevation == 0) return;
  const GroundBins bins = ground_bins(ground, row.acquisition, row.row);
  std::vector<double> gradient(static_cast<std::size_t>(row.fan.n_elevation) + 2, 0.0);
  for_each_part_of_bins(bins, row.fan, [&](int j, int k, double weight) {
    const auto bin = static_cast<std::size_t>(j);
    gradient[static_cast<std::size_t>(k + 1)] += weight * double{bins.power[bin]} * double{pixel_gradients[bin]};
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
  for_each_row(part, pixel_gradients, [&](const Row& row, std::span<const float> gradients) {
    part.of_bin.resize(gradients.size());
    for (std::size_t j = 0; j < gradients.size(); ++j) {
      part.of_bin[j] = double{gradients[j]} * beta0_per_contribution(row.acquisition, row.fan.step_rad, row.n_slices,
                                                                     static_cast<int>(j));
    }
    part.rows.integrate_adjoint(row, basis, integrator, sampling.deposit, part.of_bin,
                                {part.d_extinction, {}, part.d_source});
    if (ground != nullptr) add_ground_adjoint(part, row, *ground, gradients);
  });
}

namespace {

/// ∂D/∂w of a ray's segments, given their weights.
void by_weight(std::span<const double> weight, std::span<const double> range_bin, std::span<const double> length_bins,
               std::span<double> out) {
  double all_w = 0.0, all_wr = 0.0;
  for (std::size_t s = 0; s < weight.size(); ++s) {
    all_w += weight[s];
    all_wr += weight[s] * range_bin[s];
  }
  double nearer_w = 0.0, nearer_wr = 0.0;
  for (std::size_t s = 0; s < weight.size(); ++s) {
    const double w = weight[s], r = range_bin[s];
    const double farther_w = all_w - nearer_w - w, farther_wr = all_wr - nearer_wr - w * r;
    const double spread = (r * nearer_w - nearer_wr) + (farther_wr - r * farther_w);
    out[s] = std::max(0.0, 2.0 * spread + 2.0 / 3.0 * w * length_bins[s]);
    nearer_w += w;
    nearer_wr += w * r;
  }
}

}  // namespace

double distortion_of(RowPart& part, const RaySampling& sampling) {
  const SampleBatch& batch = part.rows.batch();
  const BatchField& field = part.rows.field();
  std::vector<double> w, range_bin, length_bins, spread;
  part.spread.resize(batch.n_segments());
  double sum = 0.0;
  for (const Row& row : part.rows.rows()) {
    const double bins_per_m = 1.0 / row.acquisition.range_spacing_m;
    const double pixels_of_ray = sampling.ray_spacing_m / (row.acquisition.range_spacing_m * sampling.sub_rows);
    for (std::size_t q = row.first_ray; q < row.end_ray; ++q) {
      const std::uint32_t begin = batch.ray_begin[q], n = batch.ray_begin[q + 1] - begin;
      w.resize(n);
      range_bin.resize(n);
      length_bins.resize(n);
      spread.resize(n);
      double transmittance = 1.0;
      for (std::uint32_t s = 0; s < n; ++s) {
        const double length_m = double{batch.length_m[begin + s]};
        const double stays = std::exp(-2.0 * length_m * double{field.extinction_per_m[begin + s]});
        length_bins[s] = length_m * bins_per_m;
        range_bin[s] = field.near_bin[begin + s] + 0.5 * length_bins[s];
        w[s] = transmittance * (1.0 - stays);
        transmittance *= stays;
      }
      by_weight(w, range_bin, length_bins, spread);
      for (std::uint32_t s = 0; s < n; ++s) {
        sum += 0.5 * pixels_of_ray * w[s] * spread[s];  // D is of second degree in w
        part.spread[begin + s] = static_cast<float>(pixels_of_ray * spread[s]);
      }
    }
  }
  return sum;
}

void add_distortion_adjoint(RowPart& part, const RaySampling& sampling, double gradient) {
  const SampleBatch& batch = part.rows.batch();
  if (part.spread.size() != batch.n_segments()) distortion_of(part, sampling);
  // Σ_s (∂D/∂w_s) w_s is what a brightness of ∂D/∂w_s would return: its derivatives by extinction are those of D.
  SegmentSpans<float> segments = spans(batch);
  const std::vector<std::uint32_t> one_bin(batch.n_segments(), 0);
  segments.bin = one_bin;
  std::vector<float> d_extinction(batch.n_segments()), unused(batch.n_segments());
  integrate_adjoint(segments, {part.rows.field().extinction_per_m, {}, part.spread, SourceForm::brightness},
                    Integrator::exact, 1, {&gradient, 1}, {d_extinction, {}, unused});
  for (std::size_t s = 0; s < d_extinction.size(); ++s) part.d_extinction[s] += d_extinction[s];
}

}  // namespace sarnerf
