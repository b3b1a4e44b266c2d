// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/mpa/azimuth_rows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sarnerf {

namespace {

constexpr double kGoldenRatio = 0.6180339887498949;

double fractional(double x) { return x - std::floor(x); }

/// Occupied intervals with a gap of at most this many bins are merged.
constexpr double kGap_bins = 1e-4;

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

void add_ray(RowRays& row, double along_track_m, int slice, int k, const Box& box_m) {
  const RangeInterval inside = clip_to_box(row.grid, along_track_m, k, box_m);
  if (!inside.empty()) row.rays.push_back({along_track_m, 0, k, inside, slice, k});
}

}  // namespace

std::size_t n_pixels(std::span<const RowRequest> rows) {
  std::size_t n = 0;
  for (const RowRequest& r : rows) n += static_cast<std::size_t>(r.acquisition.n_range);
  return n;
}

double slice_along_m(const Acquisition& a, int row, int slice, int n_slices) {
  const double width_m = a.azimuth_spacing_m / n_slices;
  return a.row_offset_m(static_cast<double>(row) - 0.5) + 0.5 * width_m + slice * width_m;
}

double beta0_per_contribution(const Acquisition& a, double step_rad, int n_slices, int j) {
  return step_rad / (a.range_spacing_m * n_slices) * a.range_m(j);
}

RowRays even_rays(const Acquisition& acquisition, int row, const Fan& fan, int n_slices, const Box& box_m) {
  RowRays out{RayGrid(acquisition, fan), {}};
  for (int slice = 0; slice < n_slices; ++slice) {
    const double along_track_m = slice_along_m(acquisition, row, slice, n_slices);
    for (int k = 0; k < fan.n_elevation; ++k) add_ray(out, along_track_m, slice, k, box_m);
  }
  return out;
}

RowRays jittered_rays(const RowRequest& request, const Box& box_m, const RowSampling& sampling) {
  const Acquisition& a = request.acquisition;
  if (box_m.empty()) return {RayGrid(a, {}), {}};
  const Comb comb = comb_over(request, box_m, sampling.ray_spacing_m);
  RowRays out{RayGrid(a, comb.fan), {}};
  for (int slice = 0; slice < sampling.sub_rows; ++slice) {
    for (int k = 0; k < comb.fan.n_elevation; ++k) {
      const double place = fractional(request.along_track_jitter + kGoldenRatio * (comb.first + k));
      const double offset = (slice + place) / sampling.sub_rows - 0.5;
      add_ray(out, a.row_offset_m(request.row + offset), slice, k, box_m);
    }
  }
  return out;
}

RowRays rays_of_row(const RowRequest& request, const Box& box_m, const RowSampling& sampling) {
  if (!request.even) return jittered_rays(request, box_m, sampling);
  return even_rays(request.acquisition, request.row, *request.even, sampling.sub_rows, box_m);
}

void AzimuthRows::clear() {
  rows_.clear();
  batch_.clear();
  field_.clear();
  bounce_.clear();
  ray_slice_.clear();
}

std::size_t AzimuthRows::n_pixels() const {
  std::size_t n = 0;
  for (const Row& row : rows_) n += static_cast<std::size_t>(row.acquisition.n_range);
  return n;
}

void AzimuthRows::begin_row(const RayGrid& grid, int row, int n_slices) {
  rows_.push_back({grid.acquisition(), row, grid.fan(), n_slices, batch_.n_rays(), batch_.n_rays()});
}

/// Stores slices and lattice positions of the rays that were just added to the batch; `first_ray` is the first one's number.
void AzimuthRows::set_places(std::span<const MarchRay> rays, std::size_t first_ray) {
  for (std::size_t n = 0; n < rays.size(); ++n) {
    ray_slice_.push_back(static_cast<std::uint32_t>(rays[n].slice));
    if (on_lattice_) {
      lattice_.set_ray(static_cast<std::size_t>(rays[n].slice), static_cast<std::size_t>(rays[n].place),
                       static_cast<std::uint32_t>(first_ray + n));
    }
  }
  if (!rows_.empty()) rows_.back().end_ray = batch_.n_rays();
}

void AzimuthRows::march(VolumeMarcher& marcher, const RayGrid& grid, std::span<const MarchRay> rays,
                        std::span<double> depth) {
  const std::size_t first = batch_.n_rays();
  marcher.march(grid, rays, batch_, field_, depth);
  set_places(rays, first);
}

void AzimuthRows::cut(VolumeMarcher& marcher, const RayGrid& grid, std::span<const MarchRay> rays, double longest_m) {
  const double spacing_m = grid.acquisition().range_spacing_m;
  const BinCut how{longest_m / spacing_m, kGap_bins};
  const auto add = [&](const MarchRay& ray, double near, double far) {
    append_bins(batch_, field_.near_bin, grid, ray.along_track_m, ray.k, near,
                std::min(far, double(grid.acquisition().n_range)), how);
  };
  coarse_.clear();
  coarse_field_.clear();
  marcher.march(grid, rays, coarse_, coarse_field_);
  for (std::size_t q = 0; q < rays.size(); ++q) {
    const std::size_t begin = coarse_.ray_begin[q], end = coarse_.ray_begin[q + 1];
    if (begin == end) continue;
    const MarchRay& ray = rays[q];
    const std::size_t number = batch_.n_rays();
    begin_ray(batch_, grid, ray.row, ray.k);
    double near = coarse_field_.near_bin[begin], far = near;
    for (std::size_t s = begin; s < end; ++s) {
      if (coarse_field_.near_bin[s] > far + kGap_bins) {
        add(ray, near, far);
        near = coarse_field_.near_bin[s];
      }
      far = coarse_field_.near_bin[s] + double{coarse_.length_m[s]} / spacing_m;
    }
    add(ray, near, far);
    set_places({&ray, 1}, number);
  }
}

void AzimuthRows::cut(const RayGrid& grid, std::span<const MarchRay> rays, double longest_m) {
  const Acquisition& a = grid.acquisition();
  const BinCut how{longest_m / a.range_spacing_m, 0.0};
  const auto bin = [&](double s_m) { return (s_m - a.range_shift_m) / a.range_spacing_m + 0.5 * a.n_range; };
  for (const MarchRay& ray : rays) {
    const std::size_t number = batch_.n_rays();
    begin_ray(batch_, grid, ray.row, ray.k);
    append_bins(batch_, field_.near_bin, grid, ray.along_track_m, ray.k, bin(ray.inside.near_m),
                std::min(bin(ray.inside.far_m), double(a.n_range)), how);
    set_places({&ray, 1}, number);
  }
}

void AzimuthRows::set_field(std::span<const float> extinction_per_m, std::span<const float> source,
                            std::span<const float> extinction_back_per_m) {
  field_.extinction_per_m.assign(extinction_per_m.begin(), extinction_per_m.end());
  field_.extinction_back_per_m.assign(extinction_back_per_m.begin(), extinction_back_per_m.end());
  field_.source.assign(source.begin(), source.end());
}

void AzimuthRows::set_bounce(std::span<const float> source, double ground_height_m) {
  bounce_.assign(source.begin(), source.end());
  foot_near_bin_.resize(n_segments());
  foot_bin_.resize(n_segments());
  for (const Row& row : rows_) {
    const double spacing_m = row.acquisition.range_spacing_m;
    for (std::size_t ray = row.first_ray; ray < row.end_ray; ++ray) {
      const double fall = -double{batch_.ray_direction[ray].y};
      for (std::uint32_t s = batch_.ray_begin[ray]; s < batch_.ray_begin[ray + 1]; ++s) {
        const double farther_m = (double{batch_.point_m[s].y} - ground_height_m) * fall;
        foot_near_bin_[s] = field_.near_bin[s] + farther_m / spacing_m;
        const double bin = std::floor(foot_near_bin_[s] + 0.5 * double{batch_.length_m[s]} / spacing_m);
        foot_bin_[s] = bin < 0.0 ? kNoBin : static_cast<std::uint32_t>(bin);
      }
    }
  }
}

FieldSamples<float> AzimuthRows::samples_of(SourceBasis basis, Path path) const {
  FieldSamples<float> of = samples(field_, basis);
  if (path == Path::by_ground) of.source = bounce_;
  return of;
}

/// A row's rays, with the segments of the whole batch, as the integrators take them: ray_begin counts from the batch's first
/// segment.
SegmentSpans<float> AzimuthRows::segments(const Row& row, Path path) const {
  SegmentSpans<float> s = spans(batch_);
  if (path == Path::by_ground) s.bin = foot_bin_;
  s.ray_begin = s.ray_begin.subspan(row.first_ray, row.end_ray - row.first_ray + 1);
  s.ray_row = s.ray_row.subspan(row.first_ray, row.end_ray - row.first_ray);
  return s;
}

void AzimuthRows::emit(SourceBasis basis, Integrator integrator, std::size_t first, std::size_t end) {
  lattice_.emit(spans(batch_), samples(field_, basis), field_.near_bin, rows_.back().acquisition.range_spacing_m, integrator,
                first, end);
}

/// Makes the lattice of all rays of a row and computes their emissions; rays and segments are counted from the row's first.
void AzimuthRows::make_lattice(const Row& row, SourceBasis basis, Integrator integrator, Path path) {
  lattice_.begin(static_cast<std::size_t>(row.n_slices),
                 std::vector<bool>(static_cast<std::size_t>(row.fan.n_elevation), true));
  on_lattice_ = false;
  const std::uint32_t begin = first_segment(row), n = end_segment(row) - begin;
  row_ray_begin_.clear();
  for (std::size_t ray = row.first_ray; ray <= row.end_ray; ++ray) row_ray_begin_.push_back(batch_.ray_begin[ray] - begin);
  for (std::size_t ray = row.first_ray; ray < row.end_ray; ++ray)
    lattice_.set_ray(ray_slice_[ray], batch_.ray_elevation[ray], static_cast<std::uint32_t>(ray - row.first_ray));
  const auto part = [&](const auto& all) { return all.empty() ? std::span(all) : std::span(all).subspan(begin, n); };
  lattice_.emit({row_ray_begin_, std::span(batch_.ray_row).subspan(row.first_ray, row.end_ray - row.first_ray),
                 part(batch_.bin), part(batch_.length_m)},
                {part(field_.extinction_per_m), part(field_.extinction_back_per_m),
                 part(path == Path::direct ? field_.source : bounce_), source_form(basis)},
                part(near_bins(path)), row.acquisition.range_spacing_m, integrator, 0, lattice_.n_places());
}

/// Calls visit(segment, contribution, x0, x1, smear) for the trapezoids of a lattice made by make_lattice().
template <class Visit>
void AzimuthRows::for_each_trapezoid(Visit&& visit) const {
  for (std::size_t slice = 0; slice < lattice_.n_slices(); ++slice) {
    for (std::size_t place = 0; place < lattice_.n_places(); ++place)
      lattice_.for_each_trapezoid(row_ray_begin_, slice, place, visit);
  }
}

void AzimuthRows::integrate(const Row& row, SourceBasis basis, Integrator integrator, Deposit deposit,
                            std::span<double> bins, Path path) {
  if (deposit == Deposit::in_bin) {
    sarnerf::integrate(segments(row, path), samples_of(basis, path), integrator, static_cast<int>(bins.size()), bins);
    return;
  }
  make_lattice(row, basis, integrator, path);
  for_each_trapezoid([&](std::size_t, double c, double x0, double x1, double smear) {
    deposit_trapezoid(bins, x0, x1, smear, c);
  });
}

void AzimuthRows::integrate_adjoint(const Row& row, SourceBasis basis, Integrator integrator, Deposit deposit,
                                    std::span<const double> bin_gradients, const FieldGradients<float>& gradients,
                                    Path path) {
  SegmentSpans<float> of_row = segments(row, path);
  if (deposit == Deposit::in_bin) {
    sarnerf::integrate_adjoint(of_row, samples_of(basis, path), integrator, static_cast<int>(bin_gradients.size()),
                               bin_gradients, gradients);
    return;
  }
  // Give each segment a bin of its own. Its derivative is the mean over the bins that the segment's trapezoid covers.
  make_lattice(row, basis, integrator, path);
  const std::size_t begin = first_segment(row);
  segment_gradients_.assign(n_segments(), 0.0);
  for_each_trapezoid([&](std::size_t s, double, double x0, double x1, double smear) {
    for_each_share(bin_gradients.size(), x0, x1, smear,
                   [&](std::size_t j, double share) { segment_gradients_[begin + s] += share * bin_gradients[j]; });
  });
  own_bin_.resize(n_segments());
  std::iota(own_bin_.begin(), own_bin_.end(), 0u);
  of_row.bin = own_bin_;
  sarnerf::integrate_adjoint(of_row, samples_of(basis, path), integrator, static_cast<int>(n_segments()),
                             segment_gradients_, gradients);
}

void AzimuthRows::begin_lattice(std::size_t n_slices, const std::vector<bool>& consecutive) {
  lattice_.begin(n_slices, consecutive);
  on_lattice_ = true;
}

void AzimuthRows::deposit(std::size_t slice, std::size_t first, std::size_t end, std::span<double> bins) const {
  for (std::size_t place = first; place < end; ++place) {
    lattice_.for_each_trapezoid(batch_.ray_begin, slice, place,
                                [&](std::size_t, double c, double x0, double x1, double smear) {
      deposit_trapezoid(bins, x0, x1, smear, c);
    });
  }
}

}  // namespace sarnerf
