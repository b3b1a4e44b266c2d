// SPDX-License-Identifier: Apache-2.0
// The one way from a ray grid to range bins and back: places of rays, cuts, both deposits, their adjoints.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "catch.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/mpa/azimuth_rows.h"

using namespace sarnerf;

namespace {

constexpr FieldChannels kChannels{false, 0, SourceBasis::scattering};
constexpr double kVoxel_m = 0.25;

Acquisition view() {
  Acquisition a;
  a.incidence_rad = 0.8;
  a.azimuth_rad = 0.5;
  a.slant_range_m = 300.0;
  a.n_azimuth = 9;
  a.n_range = 24;
  a.azimuth_spacing_m = 0.5;
  a.range_spacing_m = 0.4;
  return a;
}

/// A ball of fog of random density, 3 m across, about the aim point; or an opaque level plate as wide.
BrickGrid<float> matter(bool plate) {
  BrickGrid<float> grid({glm::dvec3(0.03, -0.02, 0.05), kVoxel_m}, kChannels.count());
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0.05f, 1.0f);
  for (int x = -7; x <= 7; ++x)
    for (int y = -7; y <= 7; ++y)
      for (int z = -7; z <= 7; ++z) {
        if (plate ? std::abs(y) > 1 : glm::length(glm::dvec3(x, y, z)) * kVoxel_m > 1.5) continue;
        const auto voxel = grid.touch_voxel({x, y, z});
        voxel[0] = plate ? 60.0f : unit(random);
        voxel[1] = plate ? 10.0f : unit(random);
      }
  return grid;
}

const Box kBox_m{glm::dvec3(-2.2), glm::dvec3(2.2)};

Fan fan_over_ball(int n) { return make_fan(angular_extent(view(), kBox_m), n); }

/// A row through the ball, marched along even rays.
struct MarchedRow {
  BrickGrid<float> grid;
  Occupancy occupancy{grid.view(), kChannels.first_source(), kChannels.first_source()};
  VolumeMarcher marcher{grid.view(), kChannels, occupancy, 0.5 * kVoxel_m};
  AzimuthRows rows;

  explicit MarchedRow(int n_rays = 30, int n_slices = 3, std::vector<int> which = {4}, bool plate = false)
      : grid(matter(plate)) {
    for (const int i : which) {
      const RowRays rays = even_rays(view(), i, fan_over_ball(n_rays), n_slices, kBox_m);
      rows.begin_row(rays.grid, i, n_slices);
      rows.march(marcher, rays.grid, rays.rays);
    }
  }

  std::vector<double> bins(Deposit deposit, std::size_t which = 0, Path path = Path::direct) {
    std::vector<double> out(static_cast<std::size_t>(view().n_range), 0.0);
    rows.integrate(rows.rows()[which], kChannels.basis, Integrator::exact, deposit, out, path);
    return out;
  }
};

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

}  // namespace

TEST_CASE("even rays: slices tile the row, rays the fan") {
  const Acquisition a = view();
  const RowRays rays = even_rays(a, 4, fan_over_ball(20), 4, Box{glm::dvec3(-1e3), glm::dvec3(1e3)});
  REQUIRE(rays.rays.size() == 80);
  for (const MarchRay& ray : rays.rays) {
    CHECK(ray.along_track_m == Approx(a.row_offset_m(4 - 0.5 + (ray.slice + 0.5) / 4)).margin(1e-12));
    CHECK(ray.place == ray.k);
  }
  CHECK(beta0_per_contribution(a, 0.01, 4, 3) == Approx(a.range_m(3) * 0.01 / (0.4 * 4)));
}

TEST_CASE("jittered rays: a comb from the aim point, which the box does not move") {
  RowRequest request{view(), 4};
  request.along_track_jitter = 0.3;
  request.fan_jitter = 0.8;
  RowSampling sampling;
  sampling.sub_rows = 2;
  const RowRays all = rays_of_row(request, kBox_m, sampling);
  const RowRays some = rays_of_row(request, Box{glm::dvec3(-0.9), glm::dvec3(0.4)}, sampling);
  REQUIRE(all.rays.size() > some.rays.size());
  const double step = sampling.ray_spacing_m / view().slant_range_m;
  for (const MarchRay& ray : some.rays) {
    const double angle = some.grid.fan().ray_angle_rad(ray.k);
    CHECK(angle / step - 0.8 == Approx(std::round(angle / step - 0.8)).margin(1e-9));
    CHECK(std::any_of(all.rays.begin(), all.rays.end(), [&](const MarchRay& other) {
      return std::abs(all.grid.fan().ray_angle_rad(other.k) - angle) < 1e-12 &&
             std::abs(other.along_track_m - ray.along_track_m) < 1e-12;
    }));
    CHECK(std::abs(ray.along_track_m - view().row_offset_m(4)) <= 0.5 * view().azimuth_spacing_m);
  }
  request.least_angle_rad = 0.0;
  const RowRays upper = rays_of_row(request, kBox_m, sampling);
  CHECK(upper.grid.fan().ray_angle_rad(0) >= 0.0);
  CHECK(rays_of_row(request, Box{}, sampling).rays.empty());
}

TEST_CASE("in the bin: a row is what the integrator makes of its segments, whatever rows lie beside it") {
  MarchedRow one, three(30, 3, {3, 4, 5});
  std::vector<double> expected(static_cast<std::size_t>(view().n_range), 0.0);
  integrate(spans(one.rows.batch()), samples(one.rows.field(), kChannels.basis), Integrator::exact, view().n_range, expected);
  CHECK(one.bins(Deposit::in_bin) == expected);
  CHECK(sum(expected) > 0.0);
  for (const Deposit deposit : {Deposit::in_bin, Deposit::over_footprint})
    CHECK(three.bins(deposit, 1) == one.bins(deposit));
}

TEST_CASE("over the footprint: the same power, spread, and closer to many rays than in the bin") {
  MarchedRow few(12, 2, {4}, true), many(1200, 40, {4}, true);
  const std::vector<double> in_bin = few.bins(Deposit::in_bin), over = few.bins(Deposit::over_footprint);
  CHECK(sum(over) == Approx(sum(in_bin)).epsilon(1e-5));  // segments that emit next to nothing are left out
  const std::vector<double> truth = many.bins(Deposit::in_bin);
  const double per_ray = sum(few.bins(Deposit::in_bin)) / sum(truth);
  double error_in_bin = 0.0, error_over = 0.0;
  for (std::size_t j = 0; j < truth.size(); ++j) {
    error_in_bin += std::pow(in_bin[j] - per_ray * truth[j], 2);
    error_over += std::pow(over[j] - per_ray * truth[j], 2);
  }
  CHECK(error_over < 0.5 * error_in_bin);
}

TEST_CASE("pieces of a lattice give the row that is deposited whole") {
  MarchedRow whole;
  const std::vector<double> expected = whole.bins(Deposit::over_footprint);
  const RowRays rays = even_rays(view(), 4, fan_over_ball(30), 3, kBox_m);
  std::vector<double> bins(expected.size(), 0.0);
  AzimuthRows rows;
  rows.begin_lattice(3, std::vector<bool>(30, true));
  for (std::size_t first = 0; first < 30;) {
    const std::size_t end = std::min<std::size_t>(30, first + 11);
    std::vector<MarchRay> part;
    for (const MarchRay& ray : rays.rays)
      if (ray.place >= static_cast<int>(first) && ray.place < static_cast<int>(end)) part.push_back(ray);
    rows.clear();
    rows.begin_row(rays.grid, 4, 3);
    rows.march(whole.marcher, rays.grid, part);
    rows.emit(kChannels.basis, Integrator::exact, first, end);
    // The last one needs its neighbour: it comes again.
    const std::size_t known = end < 30 ? end - 1 : end;
    for (std::size_t slice = 0; slice < 3; ++slice) rows.deposit(slice, first, known, bins);
    first = known;
  }
  for (std::size_t j = 0; j < bins.size(); ++j) CHECK(bins[j] == Approx(expected[j]).epsilon(1e-12).margin(1e-15));
}

TEST_CASE("by the ground, a point returns in the bin of its foot") {
  constexpr double kGround_m = -1.7;
  MarchedRow row(14, 2);
  const Acquisition a = view();
  const RadarFrame frame = radar_frame(a);
  const std::size_t n = row.rows.n_segments();
  const std::vector<double> direct = row.bins(Deposit::in_bin);
  std::vector<float> source(n);
  for (std::size_t s = 1; s < n; s += n / 23) {
    std::fill(source.begin(), source.end(), 0.0f);
    source[s] = 1.0f;
    row.rows.set_bounce(source, kGround_m);
    const std::vector<double> bins = row.bins(Deposit::in_bin, 0, Path::by_ground);
    glm::dvec3 foot = row.rows.batch().point_m[s];
    foot.y = kGround_m;
    // The range of the foot itself: the mean of both paths differs by h² sin² / 2r, 4 mm from 300 m.
    const double place = project(a, frame, foot).range_offset_m / a.range_spacing_m + 0.5 * a.n_range;
    if (std::abs(place - std::round(place)) < 0.02) continue;  // at a border of bins
    for (std::size_t j = 0; j < bins.size(); ++j) CHECK((bins[j] > 0.0) == (static_cast<double>(j) == std::floor(place)));
  }
  CHECK(row.bins(Deposit::in_bin) == direct);
  row.rows.clear();
  CHECK_FALSE(row.rows.has_bounce());
}

TEST_CASE("adjoints: in the bin against central differences, over the footprint by linearity in the source") {
  const Path path = GENERATE(Path::direct, Path::by_ground);
  MarchedRow row(14, 2);
  const std::size_t n = row.rows.n_segments();
  const std::vector<float> kappa = row.rows.field().extinction_per_m, source = row.rows.field().source;
  row.rows.set_bounce(source, -1.7);
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<double> weights(static_cast<std::size_t>(view().n_range));
  for (double& w : weights) w = normal(random);
  const auto loss = [&](Deposit deposit) {
    const std::vector<double> bins = row.bins(deposit, 0, path);
    return std::inner_product(bins.begin(), bins.end(), weights.begin(), 0.0);
  };
  std::vector<float> d_kappa(n), d_source(n);
  const auto adjoint = [&](Deposit deposit) {
    row.rows.integrate_adjoint(row.rows.rows()[0], kChannels.basis, Integrator::exact, deposit, weights,
                               {d_kappa, {}, d_source}, path);
  };

  adjoint(Deposit::in_bin);
  double largest = 0.0;
  for (const float d : d_kappa) largest = std::max(largest, std::abs(double{d}));
  for (std::size_t s = 3; s < n; s += n / 17) {
    constexpr float kStep = 0.01f;
    std::vector<float> more = kappa, less = kappa;
    more[s] += kStep;
    less[s] -= kStep;
    row.rows.set_field(more, source);
    const double above = loss(Deposit::in_bin);
    row.rows.set_field(less, source);
    const double below = loss(Deposit::in_bin);
    CHECK(double{d_kappa[s]} == Approx((above - below) / (double{more[s]} - double{less[s]})).margin(1e-4 * largest));
  }

  // Σ_s source_s ∂L/∂source_s = L for an image linear in the source; nothing else moves the trapezoids of both sides.
  row.rows.set_field(kappa, source);
  for (const Deposit deposit : {Deposit::in_bin, Deposit::over_footprint}) {
    adjoint(deposit);
    double total = 0.0, size = 0.0;
    for (std::size_t s = 0; s < n; ++s) {
      total += double{source[s]} * double{d_source[s]};
      size += std::abs(double{source[s]} * double{d_source[s]});
    }
    CHECK(std::abs(total - loss(deposit)) < 1e-5 * size);
  }
}

TEST_CASE("cut: occupied stretches at borders of bins, evenly, none too long; dense: all of the ray") {
  MarchedRow marched(10, 1);
  const RowRays rays = even_rays(view(), 4, fan_over_ball(10), 1, kBox_m);
  const double longest_m = 0.17, spacing_m = view().range_spacing_m;
  AzimuthRows cut, dense;
  cut.begin_row(rays.grid, 4, 1);
  cut.cut(marched.marcher, rays.grid, rays.rays, longest_m);
  dense.begin_row(rays.grid, 4, 1);
  dense.cut(rays.grid, rays.rays, longest_m);
  for (const AzimuthRows* rows : {&cut, &dense}) {
    const SampleBatch& batch = rows->batch();
    REQUIRE(rows->field().near_bin.size() == batch.n_segments());
    for (std::size_t s = 0; s < batch.n_segments(); ++s) {
      const double near = rows->field().near_bin[s], length = double{batch.length_m[s]} / spacing_m;
      CHECK(double{batch.length_m[s]} <= longest_m * (1.0 + 1e-4));
      CHECK(std::floor(near + 0.5 * length) == double(batch.bin[s]));
      CHECK(near + length <= std::floor(near + 1e-6) + 1.0 + 1e-5);
    }
  }
  // A ray's occupied length is the same marched or cut, and its dense one that inside of the box.
  const auto total_m = [](const SampleBatch& batch) {
    return std::accumulate(batch.length_m.begin(), batch.length_m.end(), 0.0);
  };
  CHECK(total_m(cut.batch()) == Approx(total_m(marched.rows.batch())).epsilon(1e-3));
  double inside_m = 0.0;
  for (const MarchRay& ray : rays.rays) inside_m += ray.inside.far_m - ray.inside.near_m;
  CHECK(total_m(dense.batch()) == Approx(inside_m).epsilon(1e-6));
  CHECK(dense.n_segments() > cut.n_segments());
}

TEST_CASE("cut: a swath of whole bins has one segment each, however its ends are rounded") {
  for (const double spacing_m : {0.1, 0.3, 0.37, 1.0 / 3.0}) {
    Acquisition a = view();
    a.range_spacing_m = spacing_m;
    for (const int n : {6, 7, 24, 1001}) {
      a.n_range = n;
      const double half_m = 0.5 * n * spacing_m;
      const RayGrid grid(a, make_fan({-1e-3, 1e-3}, 1));
      AzimuthRows rows;
      rows.begin_row(grid, 4, 1);
      rows.cut(grid, std::vector<MarchRay>{{0.0, 0, 0, {-half_m, half_m}}}, spacing_m);
      CHECK(rows.n_segments() == static_cast<std::size_t>(n));
    }
  }
}
