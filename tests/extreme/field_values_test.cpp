// SPDX-License-Identifier: Apache-2.0
// Sampling a field whose neighbouring voxels differ by up to 60 decades.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "../field/random_grid.h"
#include "catch.h"
#include "matrix.h"
#include "sarnerf/field/field_sampler.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Interpolation rounds its weights: voxels need a little room below the largest float.
constexpr float kLargest = 3e38f;

/// The field at many points in and around the grid, rays of all directions.
struct Samples {
  std::vector<glm::vec3> points;
  std::vector<std::uint32_t> ray_begin{0};
  std::vector<glm::vec3> direction;
  std::vector<float> extinction, extinction_back, source;
};

Samples sample(const BrickGrid<float>& grid, const FieldChannels& channels) {
  Samples s;
  s.points = random_points(8, 4000, grid.transform());
  const std::vector<double> angles = random_values<double>(9, 3 * s.points.size());
  for (std::size_t n = 0; n < s.points.size(); n += 10) {
    s.direction.push_back(glm::normalize(glm::vec3(angles[n], angles[n + 1], angles[n + 2])));
    s.ray_begin.push_back(static_cast<std::uint32_t>(n + 10));
  }
  s.extinction.resize(s.points.size());
  s.source.resize(s.points.size());
  if (channels.two_extinctions) s.extinction_back.resize(s.points.size());
  sample_field(grid.view(), channels, s.points, {s.ray_begin, s.direction},
               {s.extinction, s.extinction_back, s.source});
  return s;
}

/// Largest value of the eight voxels around a point, in one channel.
double largest_corner(const BrickGrid<double>& grid, const glm::vec3& point, int channel) {
  const glm::ivec3 low(glm::floor(grid.transform().index_from_world(glm::dvec3(point))));
  double largest = 0.0;
  for (int n = 0; n < 8; ++n) {
    const glm::ivec3 voxel = low + glm::ivec3(n >> 2 & 1, n >> 1 & 1, n & 1);
    const std::uint32_t brick = grid.topology().find(brick_of_voxel(voxel));
    if (brick == kNoBrick) continue;
    largest = std::max(largest, std::abs(grid.view().voxel(brick, offset_in_brick(voxel))[channel]));
  }
  return largest;
}

bool finite_and_not_negative(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v) && v >= 0.0f; });
}

}  // namespace

TEST_CASE("fields whose neighbouring voxels are 60 decades apart", "[core]") {
  const FieldChannels channels{true, 0, SourceBasis::scattering};
  BrickGrid<double> grid = random_grid(6, channels.count());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> exponent(-30.0, 30.0);
  for (double& value : grid.view().values) value = static_cast<float>(std::pow(10.0, exponent(random)));
  const Samples found = sample(as_float(grid), channels);
  CHECK(finite_and_not_negative(found.extinction));
  CHECK(finite_and_not_negative(found.extinction_back));
  CHECK(finite_and_not_negative(found.source));

  const std::vector<glm::dvec3> points(found.points.begin(), found.points.end());
  std::vector<double> forth(points.size()), back(points.size()), source(points.size());
  oracle::sample_field(grid.view(), channels, points, {found.ray_begin, found.direction}, {forth, back, source});
  bool right = true;
  const auto compare = [&](const std::vector<float>& values, const std::vector<double>& expected, int channel) {
    for (std::size_t n = 0; n < points.size(); ++n) {
      const double scale = largest_corner(grid, found.points[n], channel);
      const double error = scale > 0.0 ? (double(values[n]) - expected[n]) / scale : double(values[n]);
      record(Case::field_values, error);
      right &= std::abs(error) <= 1e-6;
    }
  };
  compare(found.extinction, forth, 0);
  compare(found.extinction_back, back, 1);
  compare(found.source, source, 2);
  CHECK(right);
}

TEST_CASE("fields as large as float32 allows stay finite", "[core]") {
  for (const FieldChannels& channels : {FieldChannels{true, 0, SourceBasis::scattering},
                                        FieldChannels{false, 2, SourceBasis::harmonics},
                                        FieldChannels{false, 0, SourceBasis::harmonics}}) {
    BrickGrid<double> grid = random_grid(6, channels.count());
    for (double& value : grid.view().values) value = double(kLargest);
    // Harmonics of either sign.
    for (std::size_t n = 0; channels.harmonics_degree > 0 && n < grid.view().values.size(); n += 3) {
      const bool extinction = n % static_cast<std::size_t>(channels.count()) == 0;
      if (!extinction) grid.view().values[n] *= -1.0;
    }
    const Samples found = sample(as_float(grid), channels);
    CHECK(finite_and_not_negative(found.extinction));
    CHECK(finite_and_not_negative(found.extinction_back));
    CHECK(finite_and_not_negative(found.source));
  }
}
