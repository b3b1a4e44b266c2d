// SPDX-License-Identifier: Apache-2.0
#include "field/rows.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sarnerf/mpa/integrate.h"

namespace sarnerf {

namespace {

constexpr double kGoldenRatio = 0.6180339887498949;

double fractional(double x) { return x - std::floor(x); }

struct Comb {
  Fan fan;
  double first;  ///< number of the first ray, counted from the aim point
};

Comb comb_over(const RowRequest& request, const Box& box_m, double spacing_m) {
  const auto extent = angular_extent(request.acquisition, box_m);
  const double low = std::max(extent.first, request.least_angle_rad);
  const double high = std::min(extent.second, request.most_angle_rad);
  const double step = spacing_m / request.acquisition.slant_range_m, jitter = request.fan_jitter;
  // Ray n has the angle (n + jitter) step; the fan begins half a step before its first ray.
  const double first = std::ceil(low / step - jitter), last = std::floor(high / step - jitter);
  return {{(first + jitter - 0.5) * step, step, std::max(0, static_cast<int>(last - first) + 1)},
          first};
}

}  // namespace

RowRays rays_of_row(const RowRequest& request, const Box& box_m, const RaySampling& sampling) {
  const Acquisition& a = request.acquisition;
  if (box_m.empty()) return {RayGrid(a, {}), {}};
  const Comb comb = comb_over(request, box_m, sampling.ray_spacing_m);
  RowRays row{RayGrid(a, comb.fan), {}};
  for (int m = 0; m < sampling.sub_rows; ++m) {
    for (int k = 0; k < comb.fan.n_elevation; ++k) {
      const double place = fractional(request.along_track_jitter + kGoldenRatio * (comb.first + k));
      const double offset = (m + place) / sampling.sub_rows - 0.5;
      const double along_track_m = a.row_offset_m(request.row + offset);
      const RangeInterval inside = clip_to_box(row.grid, along_track_m, k, box_m);
      if (!inside.empty()) row.rays.push_back({along_track_m, 0, k, inside});
    }
  }
  return row;
}

std::size_t n_pixels(std::span<const RowRequest> rows) {
  std::size_t n = 0;
  for (const RowRequest& r : rows) n += static_cast<std::size_t>(r.acquisition.n_range);
  return n;
}

namespace {

/// Brightness of a pixel over the sum of its contributions: r_j Δθ / Δr, shared by the sub-rows.
double pixel_scale(const RowPart::Row& row, int sub_rows, int j) {
  const Acquisition& a = row.acquisition;
  return a.range_m(j) * row.fan.step_rad / (a.range_spacing_m * sub_rows);
}

}  // namespace

void row_pixels(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                Integrator integrator, const RaySampling& sampling, std::span<float> pixels) {
  part.of_pixel.assign(pixels.size(), 0.0);
  integrate(part.segments(row), field, integrator, static_cast<int>(pixels.size()), part.of_pixel);
  for (std::size_t j = 0; j < pixels.size(); ++j)
    pixels[j] = static_cast<float>(part.of_pixel[j] *
                                   pixel_scale(row, sampling.sub_rows, static_cast<int>(j)));
}

void row_pixels_adjoint(RowPart& part, const RowPart::Row& row, const FieldSamples<float>& field,
                        Integrator integrator, const RaySampling& sampling,
                        std::span<const float> pixel_gradients) {
  part.of_pixel.resize(pixel_gradients.size());
  for (std::size_t j = 0; j < pixel_gradients.size(); ++j)
    part.of_pixel[j] =
        double{pixel_gradients[j]} * pixel_scale(row, sampling.sub_rows, static_cast<int>(j));
  integrate_adjoint(part.segments(row), field, integrator, static_cast<int>(pixel_gradients.size()),
                    part.of_pixel, {part.d_extinction, {}, part.d_source});
}

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

namespace {

/// ∂D/∂w of a ray's segments, given their weights.
void by_weight(std::span<const double> weight, std::span<const double> range_bin, std::span<const double> length_bins,
               std::span<float> out) {
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
    out[s] = static_cast<float>(std::max(0.0, 2.0 * spread + 2.0 / 3.0 * w * length_bins[s]));
    nearer_w += w;
    nearer_wr += w * r;
  }
}

}  // namespace

void add_distortion_gradient(RowPart& part, const std::function<double(const RowPart::Row&)>& weight) {
  std::vector<double> w, range_bin, length_bins;
  std::vector<float> spread(part.batch.n_segments()), d_extinction(spread.size()), unused(spread.size());
  for (const RowPart::Row& row : part.rows) {
    const double bins_per_m = 1.0 / row.acquisition.range_spacing_m;
    const auto row_weight = static_cast<float>(weight(row));
    for (std::size_t q = row.first_ray; q < row.end_ray; ++q) {
      const std::uint32_t begin = part.batch.ray_begin[q], n = part.batch.ray_begin[q + 1] - begin;
      w.resize(n);
      range_bin.resize(n);
      length_bins.resize(n);
      double transmittance = 1.0;
      for (std::uint32_t s = 0; s < n; ++s) {
        const double length_m = double{part.batch.length_m[begin + s]};
        const double stays = std::exp(-2.0 * length_m * double{part.field.extinction_per_m[begin + s]});
        length_bins[s] = length_m * bins_per_m;
        range_bin[s] = part.field.near_bin[begin + s] + 0.5 * length_bins[s];
        w[s] = transmittance * (1.0 - stays);
        transmittance *= stays;
      }
      const auto out = std::span(spread).subspan(begin, n);
      by_weight(w, range_bin, length_bins, out);
      for (float& d : out) d *= row_weight;
    }
  }
  // Σ_s (∂D/∂w_s) w_s is what a brightness of ∂D/∂w_s would return: its derivatives by extinction are those of D.
  SegmentSpans<float> segments = spans(part.batch);
  const std::vector<std::uint32_t> one_bin(part.batch.n_segments(), 0);
  segments.bin = one_bin;
  const double one = 1.0;
  const std::span<const double> gradient(&one, 1);
  integrate_adjoint(segments, {part.field.extinction_per_m, {}, spread, SourceForm::brightness}, Integrator::exact,
                    1, gradient, {d_extinction, {}, unused});
  for (std::size_t s = 0; s < d_extinction.size(); ++s) part.d_extinction[s] += d_extinction[s];
}

}  // namespace sarnerf
