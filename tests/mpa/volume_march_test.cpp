// SPDX-License-Identifier: Apache-2.0
// Leaving out empty space and what lies behind opaque matter changes nothing (docs/design.md, Rules).
#include <algorithm>
#include <cmath>
#include <random>

#include "catch.h"
#include "dense_segments.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/mpa/volume_march.h"

using namespace sarnerf;
using test::append_segments;

namespace {

constexpr double kMarchVoxel_m = 0.25;
constexpr FieldChannels kMarchChannels{false, 0, SourceBasis::scattering};

/// Clumps of matter far apart, on both sides of the origin: extinction up to `most`, scattering beside it.
BrickGrid<float> clumps(unsigned seed, float most) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  BrickGrid<float> grid({{0.03, -0.02, 0.01}, kMarchVoxel_m}, kMarchChannels.count());
  for (int clump = 0; clump < 12; ++clump) {
    const glm::ivec3 centre(glm::vec3(unit(random), unit(random), unit(random)) * 60.0f - 30.0f);
    for (int x = -3; x <= 3; ++x) {
      for (int y = -3; y <= 3; ++y) {
        for (int z = -3; z <= 3; ++z) {
          if (unit(random) < 0.3f) continue;
          const auto voxel = grid.touch_voxel(centre + glm::ivec3(x, y, z));
          voxel[0] = most * unit(random);
          voxel[1] = unit(random);
        }
      }
    }
  }
  return grid;
}

RayGrid rays_of_view() {
  Acquisition a;
  a.azimuth_rad = 0.4;
  a.incidence_rad = 0.8;
  a.slant_range_m = 5000.0;
  a.n_azimuth = 1;
  a.n_range = 96;
  a.azimuth_spacing_m = 0.3;
  a.range_spacing_m = 0.3;
  return RayGrid(a, make_fan({-0.002, 0.002}, 64));
}

/// Pixels of one row from a batch.
std::vector<double> pixels(const SampleBatch& batch, const BatchField& field, int n_range) {
  std::vector<double> row(static_cast<std::size_t>(n_range), 0.0);
  integrate(spans(batch), samples(field, kMarchChannels.basis), Integrator::exact, n_range, row);
  return row;
}

/// Every ray cut all along the swath into segments of `longest_m`, and sampled everywhere.
std::vector<double> dense(const RayGrid& rays, const BrickGrid<float>& grid, double longest_m, double along_m) {
  SampleBatch batch;
  BatchField field;
  const Acquisition& a = rays.acquisition();
  const double half_m = 0.5 * a.n_range * a.range_spacing_m;
  for (int k = 0; k < rays.fan().n_elevation; ++k) {
    begin_ray(batch, rays, 0, k);
    append_segments(batch, rays, along_m, k, {-3.0 * half_m, half_m}, longest_m);
  }
  field.extinction_per_m.resize(batch.n_segments());
  field.source.resize(batch.n_segments());
  sample_field(grid.view(), kMarchChannels, batch.point_m, {batch.ray_begin, batch.ray_direction},
               {field.extinction_per_m, {}, field.source});
  return pixels(batch, field, a.n_range);
}

struct Marched {
  SampleBatch batch;
  BatchField field;
  std::vector<double> depth;  ///< of each ray
};

Marched march(const RayGrid& rays, const BrickGrid<float>& grid, double longest_m, double along_m) {
  const Occupancy occupancy(grid.view(), kMarchChannels.first_source(), kMarchChannels.first_source());
  VolumeMarcher marcher(grid.view(), kMarchChannels, occupancy, longest_m);
  Marched out;
  const Acquisition& a = rays.acquisition();
  const double half_m = 0.5 * a.n_range * a.range_spacing_m;
  std::vector<MarchRay> all;
  for (int k = 0; k < rays.fan().n_elevation; ++k) all.push_back({along_m, 0, k, {-3.0 * half_m, half_m}});
  out.depth.resize(all.size());
  marcher.march(rays, all, out.batch, out.field, out.depth);
  return out;
}

double relative_l2(const std::vector<double>& found, const std::vector<double>& expected) {
  double difference = 0.0, norm = 0.0;
  for (std::size_t n = 0; n < expected.size(); ++n) {
    difference += (found[n] - expected[n]) * (found[n] - expected[n]);
    norm += expected[n] * expected[n];
  }
  return std::sqrt(difference / norm);
}

}  // namespace

TEST_CASE("marching occupied cells alone gives what sampling the whole ray gives") {
  const RayGrid rays = rays_of_view();
  for (const float most : {0.05f, 3.0f, 200.0f}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      INFO("extinction up to " << most << ", seed " << seed);
      const BrickGrid<float> grid = clumps(seed, most);
      for (const double along_m : {-4.1, 0.0, 2.7}) {
        const double longest_m = 0.02 * kMarchVoxel_m;
        const Marched marched = march(rays, grid, longest_m, along_m);
        const std::vector<double> found = pixels(marched.batch, marched.field, rays.acquisition().n_range);
        const std::vector<double> expected = dense(rays, grid, longest_m, along_m);
        REQUIRE(*std::max_element(expected.begin(), expected.end()) > 0.0);
        // Both cut rays into steps of a fiftieth of a voxel, elsewhere: they differ by the rule's error.
        CHECK(relative_l2(found, expected) < (most > 10.0f ? 3e-3 : 3e-4));
      }
    }
  }
}

TEST_CASE("segments are in order, inside their bins, as short as asked, and cover all matter before the end") {
  const RayGrid rays = rays_of_view();
  const Acquisition& a = rays.acquisition();
  const BrickGrid<float> grid = clumps(5, 1.0f);
  const double longest_m = 0.5 * kMarchVoxel_m;
  const Marched marched = march(rays, grid, longest_m, 1.3);
  const SampleBatch& batch = marched.batch;
  TrilinearSampler sampler(grid.view());
  int n_covered = 0;
  for (std::size_t ray = 0; ray < batch.n_rays(); ++ray) {
    const int k = static_cast<int>(ray);
    double last_bin = -1e9;
    for (std::uint32_t q = batch.ray_begin[ray]; q < batch.ray_begin[ray + 1]; ++q) {
      const double length_bins = double(batch.length_m[q]) / a.range_spacing_m;
      const double near = marched.field.near_bin[q], far = near + length_bins;
      CHECK(near >= last_bin - 1e-6);
      CHECK(batch.length_m[q] <= longest_m * (1.0 + 1e-6));
      if (batch.bin[q] != kNoBin) {
        CHECK(near >= batch.bin[q] - 1e-6);
        CHECK(far <= batch.bin[q] + 1.0 + 1e-6);
      }
      last_bin = far;
    }
    // Wherever there is matter there is a segment.
    const double half_m = 0.5 * a.n_range * a.range_spacing_m;
    for (double s = -3.0 * half_m; s < half_m; s += 0.11 * kMarchVoxel_m) {
      const glm::vec3 point(rays.point_from_aim_m(1.3, s, k));
      float value[2];
      sampler.sample({&point, 1}, value);
      if (!(value[0] > 1e-6f)) continue;
      ++n_covered;
      const double x = s / a.range_spacing_m + 0.5 * a.n_range;
      bool covered = false;
      for (std::uint32_t q = batch.ray_begin[ray]; q < batch.ray_begin[ray + 1]; ++q) {
        const double near = marched.field.near_bin[q];
        covered |= x >= near - 1e-3 && x <= near + double(batch.length_m[q]) / a.range_spacing_m + 1e-3;
      }
      CHECK(covered);
    }
  }
  CHECK(n_covered > 300);
}

TEST_CASE("a ray ends behind an optical depth of 20") {
  const RayGrid rays = rays_of_view();
  const BrickGrid<float> opaque = clumps(2, 2000.0f);
  const Marched marched = march(rays, opaque, 0.5 * kMarchVoxel_m, 0.0);
  const auto n_ended = std::count_if(marched.depth.begin(), marched.depth.end(),
                                     [](double depth) { return depth >= kEndOfRayDepth; });
  CHECK(n_ended > 0);
  // The same matter, two million times clearer: no ray ends in it.
  const BrickGrid<float> clear = clumps(2, 1e-3f);
  const Marched through = march(rays, clear, 0.5 * kMarchVoxel_m, 0.0);
  CHECK(marched.batch.n_segments() < through.batch.n_segments());
  for (std::size_t ray = 0; ray < marched.depth.size(); ++ray) {
    const std::uint32_t first = marched.batch.ray_begin[ray], end = marched.batch.ray_begin[ray + 1];
    const auto n_through = through.batch.ray_begin[ray + 1] - through.batch.ray_begin[ray];
    INFO(ray);
    if (marched.depth[ray] < kEndOfRayDepth) {
      CHECK(end - first == n_through);
      continue;
    }
    // The depth is reached, and rays end with the run of segments that reaches it: two long ones, cut at borders of bins and bricks.
    constexpr std::uint32_t kMostOfRun = 4;
    double depth = 0.0;
    std::uint32_t n_needed = 0;
    for (std::uint32_t q = first; q < end && depth < kEndOfRayDepth; ++q, ++n_needed)
      depth += 2.0 * double(marched.field.extinction_per_m[q]) * double(marched.batch.length_m[q]);
    CHECK(depth >= kEndOfRayDepth);
    CHECK(end - first < n_needed + kMostOfRun);
    CHECK(n_needed <= n_through);
  }
}
