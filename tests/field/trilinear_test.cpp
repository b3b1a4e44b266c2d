// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/field_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.h"
#include "random_grid.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::vector<glm::dvec3> as_double(const std::vector<glm::vec3>& points) {
  return std::vector<glm::dvec3>(points.begin(), points.end());
}

/// The field as one dense array of [-24, 24)³ voxels: another way to the same numbers.
struct DenseGrid {
  static constexpr int kHalf = 24, kSide = 2 * kHalf;
  explicit DenseGrid(const BrickGrid<double>& grid)
      : n_channels(grid.n_channels()),
        values(static_cast<std::size_t>(kSide * kSide * kSide * n_channels), 0.0) {
    for (std::uint32_t b = 0; b < grid.topology().n_bricks(); ++b) {
      for (int offset = 0; offset < kBrickVoxels; ++offset) {
        const glm::ivec3 voxel =
            8 * grid.topology().coordinate(b) + glm::ivec3(offset / 64, offset / 8 % 8, offset % 8);
        for (int c = 0; c < n_channels; ++c) at(voxel, c) = grid.view().voxel(b, offset)[c];
      }
    }
  }
  double& at(const glm::ivec3& voxel, int c) {
    const glm::ivec3 v = voxel + kHalf;
    return values[static_cast<std::size_t>(((v.x * kSide + v.y) * kSide + v.z) * n_channels + c)];
  }
  double sample(const glm::dvec3& index, int c) {
    const glm::ivec3 v(glm::floor(index));
    const glm::dvec3 f = index - glm::floor(index);
    const auto along_z = [&](int x, int y) {
      return glm::mix(at(v + glm::ivec3(x, y, 0), c), at(v + glm::ivec3(x, y, 1), c), f.z);
    };
    return glm::mix(glm::mix(along_z(0, 0), along_z(0, 1), f.y),
                    glm::mix(along_z(1, 0), along_z(1, 1), f.y), f.x);
  }
  int n_channels;
  std::vector<double> values;
};

}  // namespace

TEST_CASE("a linear function is reproduced, across borders and below 0") {
  const GridTransform transform{{10.5, -3.25, 0.125}, 0.25};
  BrickGrid<float> grid(transform, 2);
  const glm::dvec3 slope[2] = {{1.5, -0.5, 2.0}, {0.25, 3.0, -1.0}};
  for (int x = -16; x < 16; ++x) {
    for (int y = -16; y < 16; ++y) {
      for (int z = -16; z < 16; ++z) {
        const glm::dvec3 p = transform.world_from_index(glm::dvec3(x, y, z)) - transform.origin_m;
        const std::span<float> voxel = grid.touch_voxel({x, y, z});
        for (std::size_t c = 0; c < 2; ++c)
          voxel[c] = static_cast<float>(glm::dot(slope[c], p) + 1.0);
      }
    }
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<double> inside(-16.0, 15.0);
  std::vector<glm::vec3> points(2000);
  for (std::size_t n = 0; n < points.size(); ++n) {
    glm::dvec3 index(inside(random), inside(random), inside(random));
    if (n % 3 == 0) index = glm::round(index);
    points[n] = glm::vec3(transform.world_from_index(index));
  }
  std::vector<float> samples(2 * points.size());
  sample_trilinear(grid.view(), points, samples);
  for (std::size_t n = 0; n < points.size(); ++n) {
    const glm::dvec3 p = glm::dvec3(points[n]) - transform.origin_m;
    for (std::size_t c = 0; c < 2; ++c) {
      CHECK(std::abs(static_cast<double>(samples[2 * n + c]) - (glm::dot(slope[c], p) + 1.0)) <
            1e-5);
    }
  }
}

TEST_CASE("samples agree with a dense grid and with the oracle, for any number of channels") {
  for (int n_channels : {1, 2, 3, 4, 5, 6, 7, 10, 11, 16}) {
    const BrickGrid<double> grid = random_grid(static_cast<unsigned>(n_channels), n_channels);
    const BrickGrid<float> grid_float = as_float(grid);
    DenseGrid dense(grid);
    const std::vector<glm::vec3> points = random_points(2, 3000, grid.transform());
    const auto n = static_cast<std::size_t>(n_channels);
    std::vector<double> expected(n * points.size());
    oracle::sample_trilinear(grid.view(), as_double(points), expected);
    std::vector<float> found(n * points.size(), 99.0f);
    sample_trilinear(grid_float.view(), points, found);
    double worst_oracle = 0.0, worst_float = 0.0;
    for (std::size_t s = 0; s < points.size(); ++s) {
      const glm::dvec3 index = grid.transform().index_from_world(glm::dvec3(points[s]));
      for (std::size_t c = 0; c < n; ++c) {
        const double truth = dense.sample(index, static_cast<int>(c));
        worst_oracle = worse(worst_oracle, std::abs(expected[s * n + c] - truth));
        worst_float =
            worse(worst_float, std::abs(static_cast<double>(found[s * n + c]) - truth));
      }
    }
    INFO(n_channels << " channels");
    CHECK(worst_oracle < 1e-14);
    CHECK(worst_float < 3e-7);
  }
}

TEST_CASE("at voxel centres the samples are the voxels") {
  BrickGrid<float> grid({glm::dvec3(0.0), 0.5}, 1);
  std::vector<glm::vec3> points;
  for (int n = -20; n < 20; ++n) {
    grid.touch_voxel({n, -n, 3})[0] = static_cast<float>(n);
    points.emplace_back(0.5f * glm::vec3(n, -n, 3));
  }
  std::vector<float> samples(points.size());
  sample_trilinear(grid.view(), points, samples);
  for (int n = -20; n < 20; ++n)
    CHECK(samples[static_cast<std::size_t>(n + 20)] == static_cast<float>(n));
}

TEST_CASE("the adjoint is the transpose") {
  for (int n_channels : {1, 4, 5, 10}) {
    const BrickGrid<double> grid = random_grid(3, n_channels);
    const BrickGrid<float> grid_float = as_float(grid);
    const std::vector<glm::vec3> points = random_points(4, 2000, grid.transform());
    const std::size_t n = points.size() * static_cast<std::size_t>(n_channels);
    const std::vector<float> g = random_values<float>(5, n);

    std::vector<double> samples(n), adjoint(grid.view().values.size(), 0.0);
    oracle::sample_trilinear(grid.view(), as_double(points), samples);
    const BrickView<double> into{&grid.topology(), grid.transform(), n_channels, adjoint};
    oracle::scatter_trilinear(into, as_double(points), converted<double>(g));
    double left = 0.0, right = 0.0;
    for (std::size_t m = 0; m < n; ++m) left += samples[m] * static_cast<double>(g[m]);
    for (std::size_t m = 0; m < adjoint.size(); ++m) right += adjoint[m] * grid.view().values[m];
    CHECK(left == Approx(right).epsilon(1e-12));

    // And the float32 one is the oracle's; it adds to what is there.
    std::vector<float> found(adjoint.size(), 1.0f);
    scatter_trilinear({&grid_float.topology(), grid_float.transform(), n_channels, found}, points,
                      g);
    double worst = 0.0;
    for (std::size_t m = 0; m < adjoint.size(); ++m) {
      worst = worse(worst, std::abs(static_cast<double>(found[m]) - 1.0 - adjoint[m]));
    }
    CHECK(worst < 2e-6);
  }
}

TEST_CASE("gradients are those of the interpolation within each cell, and their adjoint is the transpose") {
  const BrickGrid<double> exact = random_grid(5, 1);
  BrickGrid<float> grid = as_float(exact);
  const std::vector<glm::vec3> points = random_points(6, 4000, grid.transform());
  std::vector<glm::vec3> gradients(points.size());
  sample_gradients(grid.view(), points, gradients);
  DenseGrid dense(exact);
  int n_checked = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const glm::dvec3 index = grid.transform().index_from_world(glm::dvec3(points[n]));
    constexpr double kStep = 1e-3;
    for (int axis = 0; axis < 3; ++axis) {
      const double fraction = index[axis] - std::floor(index[axis]);
      if (fraction < 2 * kStep || fraction > 1 - 2 * kStep || std::abs(index[axis]) > 21.0) continue;
      glm::dvec3 low = index, high = index;
      low[axis] -= kStep;
      high[axis] += kStep;
      const double difference = (dense.sample(high, 0) - dense.sample(low, 0)) / (2 * kStep * grid.transform().voxel_size_m);
      CHECK(std::abs(double{gradients[n][axis]} - difference) < 2e-4);
      ++n_checked;
    }
  }
  CHECK(n_checked > 10000);

  const std::vector<float> by = random_values<float>(7, 3 * points.size());
  std::vector<glm::vec3> by_gradients(points.size());
  for (std::size_t n = 0; n < points.size(); ++n) by_gradients[n] = {by[3 * n], by[3 * n + 1], by[3 * n + 2]};
  BrickGrid<float> by_voxels = as_float(exact);
  std::ranges::fill(by_voxels.view().values, 0.0f);
  scatter_gradients(by_voxels.view(), points, by_gradients);
  double forward = 0.0, backward = 0.0;
  for (std::size_t n = 0; n < points.size(); ++n) forward += double{glm::dot(gradients[n], by_gradients[n])};
  for (std::size_t v = 0; v < grid.view().values.size(); ++v) backward += double{grid.view().values[v]} * double{by_voxels.view().values[v]};
  CHECK(std::abs(forward - backward) < 1e-3 * std::abs(forward) + 1e-2);
  CHECK_THROWS_AS(sample_gradients(grid.view(), points, std::span(gradients).first(3)), UsageError);
  const BrickGrid<float> two(grid.transform(), 2);
  CHECK_THROWS_AS(sample_gradients(two.view(), points, gradients), UsageError);
}

TEST_CASE("outside of all bricks there is nothing, wherever that is") {
  BrickGrid<float> grid({}, 1);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<glm::vec3> points{{0, 0, 0},      {kNan, 0, 0}, {0, kInfinity, 0},
                                      {0, 0, -3e38f}, {2e9f, 1, 1}, {-2e9f, 1, 1}};
  std::vector<float> samples(points.size(), 7.0f);
  sample_trilinear(grid.view(), points, samples);
  CHECK(samples == std::vector<float>(points.size(), 0.0f));
  grid.touch_voxel({0, 0, 0})[0] = 1.0f;
  sample_trilinear(grid.view(), points, samples);
  CHECK(samples == std::vector<float>{1, 0, 0, 0, 0, 0});
  scatter_trilinear(grid.view(), points, samples);
  CHECK(grid.touch_voxel({0, 0, 0})[0] == 2.0f);
}

TEST_CASE("a cell that reaches into a brick from outside sees its half") {
  BrickGrid<float> grid({}, 1);
  grid.touch_voxel({0, 0, 0})[0] = 8.0f;
  const std::vector<glm::vec3> points{
      {-0.5f, 0, 0}, {-0.5f, -0.5f, 0}, {-0.5f, -0.5f, -0.5f}, {-1, 0, 0}};
  std::vector<float> samples(4);
  sample_trilinear(grid.view(), points, samples);
  CHECK(samples == std::vector<float>{4, 2, 1, 0});
}

TEST_CASE("lengths that do not fit are refused") {
  const BrickGrid<float> grid({}, 2);
  const std::vector<glm::vec3> points(3);
  std::vector<float> samples(5);
  CHECK_THROWS_AS(sample_trilinear(grid.view(), points, samples), UsageError);
}
