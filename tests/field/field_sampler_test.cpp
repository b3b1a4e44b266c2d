// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/field_sampler.h"

#include <algorithm>
#include <cmath>

#include "catch.h"
#include "random_grid.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Points on rays, empty rays among them; more points than one block of the float32 version.
struct Rays {
  explicit Rays(std::size_t n_points) {
    std::mt19937 random(9);
    std::normal_distribution<float> normal;
    std::size_t next = 0;
    for (unsigned q = 0; next < n_points; ++q) {
      direction.push_back(
          glm::normalize(glm::vec3(normal(random), normal(random), normal(random))));
      next = std::min(n_points, next + (q % 5 == 0 ? 0 : 13 * q % 70));
      begin.push_back(static_cast<std::uint32_t>(next));
    }
  }
  RayDirections view() const { return {begin, direction}; }
  std::vector<std::uint32_t> begin{0};
  std::vector<glm::vec3> direction;
};

template <class T>
struct Arrays {
  Arrays(std::size_t n, bool two_extinctions)
      : extinction(n), extinction_back(two_extinctions ? n : 0), brightness(n) {}
  FieldPoints<T> spans() { return {extinction, extinction_back, brightness}; }
  FieldPoints<const T> view() const { return {extinction, extinction_back, brightness}; }
  std::vector<T> extinction, extinction_back, brightness;
};

double distance(const std::vector<float>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double largest = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    largest = worse(largest, std::abs(static_cast<double>(a[n]) - b[n]));
  }
  return largest;
}

constexpr FieldChannels kChannels[] = {{false, 0}, {false, 1}, {false, 2},
                                       {true, 0},  {true, 1},  {true, 2}};

}  // namespace

TEST_CASE("a field is interpolated first, combined then, and clamped last") {
  // Two neighbouring voxels whose brightness cancels half-way for one direction: clamping voxels first
  // would leave half of the positive one.
  BrickGrid<double> grid({}, 5);
  const std::vector<double> positive{1, 2, 0, 0, 0}, negative{3, -2, 0, 0, 0};
  std::copy(positive.begin(), positive.end(), grid.touch_voxel({0, 0, 0}).begin());
  std::copy(negative.begin(), negative.end(), grid.touch_voxel({0, 0, 1}).begin());
  const std::vector<glm::dvec3> points{{0, 0, 0.25}, {0, 0, 0.5}, {0, 0, 0.75}};
  const std::vector<std::uint32_t> begin{0, 3};
  const std::vector<glm::vec3> direction{{0, 0, 1}};
  Arrays<double> out(3, false);
  oracle::sample_field(grid.view(), {false, 1}, points, {begin, direction}, out.spans());
  const double y0 = 0.5 / std::sqrt(3.14159265358979323846);
  CHECK(out.brightness[0] == Approx(y0));
  CHECK(out.brightness[1] == Approx(0.0).margin(1e-15));
  CHECK(out.brightness[2] == 0.0);
  CHECK(out.extinction[1] == Approx(2.0));
}

TEST_CASE("field samples agree with the oracle") {
  for (const FieldChannels& channels : kChannels) {
    const BrickGrid<double> grid = random_grid(21, channels.count());
    const BrickGrid<float> grid_float = as_float(grid);
    const std::vector<glm::vec3> points = random_points(22, 1000, grid.transform());
    const std::vector<glm::dvec3> points_double(points.begin(), points.end());
    const Rays rays(points.size());

    Arrays<double> expected(points.size(), channels.two_extinctions);
    oracle::sample_field(grid.view(), channels, points_double, rays.view(), expected.spans());
    Arrays<float> found(points.size(), channels.two_extinctions);
    sample_field(grid_float.view(), channels, points, rays.view(), found.spans());
    CHECK(distance(found.extinction, expected.extinction) < 1e-6);
    CHECK(distance(found.extinction_back, expected.extinction_back) < 1e-6);
    CHECK(distance(found.brightness, expected.brightness) < 1e-6);

    // The adjoint's clamp is decided by the same brightness in both.
    Arrays<float> g(points.size(), channels.two_extinctions);
    g.extinction = random_values<float>(1, g.extinction.size());
    g.extinction_back = random_values<float>(2, g.extinction_back.size());
    g.brightness = random_values<float>(3, g.brightness.size());
    Arrays<double> g_double(points.size(), channels.two_extinctions);
    g_double.extinction = converted<double>(g.extinction);
    g_double.extinction_back = converted<double>(g.extinction_back);
    g_double.brightness = converted<double>(g.brightness);
    std::vector<double> by_voxel(grid.view().values.size(), 0.0);
    std::vector<float> by_voxel_float(by_voxel.size(), 0.0f);
    oracle::sample_field_adjoint({&grid.topology(), grid.transform(), channels.count(), by_voxel},
                                 channels, points_double, rays.view(),
                                 converted<double>(found.brightness), g_double.view());
    sample_field_adjoint({&grid.topology(), grid.transform(), channels.count(), by_voxel_float},
                         channels, points, rays.view(), found.brightness, g.view());
    CHECK(distance(by_voxel_float, by_voxel) < 2e-6);
  }
}

TEST_CASE("the adjoint of field samples is the derivative") {
  for (const FieldChannels& channels : kChannels) {
    BrickGrid<double> grid = random_grid(31, channels.count());
    const std::vector<glm::vec3> points_float = random_points(32, 60, grid.transform());
    const std::vector<glm::dvec3> points(points_float.begin(), points_float.end());
    const Rays rays(points.size());
    Arrays<double> g(points.size(), channels.two_extinctions);
    g.extinction = random_values<double>(4, g.extinction.size());
    g.extinction_back = random_values<double>(5, g.extinction_back.size());
    g.brightness = random_values<double>(6, g.brightness.size());

    const auto loss = [&] {
      Arrays<double> out(points.size(), channels.two_extinctions);
      oracle::sample_field(grid.view(), channels, points, rays.view(), out.spans());
      double sum = 0.0;
      for (std::size_t s = 0; s < points.size(); ++s) {
        sum += g.extinction[s] * out.extinction[s] + g.brightness[s] * out.brightness[s];
        if (channels.two_extinctions) sum += g.extinction_back[s] * out.extinction_back[s];
      }
      return sum;
    };
    Arrays<double> out(points.size(), channels.two_extinctions);
    oracle::sample_field(grid.view(), channels, points, rays.view(), out.spans());
    std::vector<double> found(grid.view().values.size(), 0.0);
    oracle::sample_field_adjoint({&grid.topology(), grid.transform(), channels.count(), found},
                                 channels, points, rays.view(), out.brightness, g.view());
    int compared = 0;
    for (std::size_t n = 0; n < found.size() && compared < 120; n += 7) {
      if (std::abs(found[n]) < 1e-3) continue;
      constexpr double kStep = 1e-6;  // L is piecewise linear: no truncation error
      double& value = grid.view().values[n];
      const double at = value;
      value = at + kStep;
      const double ahead = loss();
      value = at - kStep;
      const double behind = loss();
      value = at;
      CHECK(found[n] == Approx((ahead - behind) / (2.0 * kStep)).epsilon(1e-6));
      ++compared;
    }
    CHECK(compared > 20);
  }
}

TEST_CASE("scattering and cosine bases agree with the oracle") {
  for (const FieldChannels& channels : {FieldChannels{false, 0, SourceBasis::scattering},
                                        FieldChannels{true, 0, SourceBasis::scattering},
                                        FieldChannels{false, 0, SourceBasis::cosine},
                                        FieldChannels{true, 0, SourceBasis::cosine}}) {
    const BrickGrid<double> grid = random_grid(31, channels.count());
    const std::vector<glm::vec3> points = random_points(32, 1000, grid.transform());
    const std::vector<glm::dvec3> points_double(points.begin(), points.end());
    const Rays rays(points.size());
    Arrays<double> expected(points.size(), channels.two_extinctions);
    oracle::sample_field(grid.view(), channels, points_double, rays.view(), expected.spans());
    Arrays<float> found(points.size(), channels.two_extinctions);
    sample_field(as_float(grid).view(), channels, points, rays.view(), found.spans());
    CHECK(distance(found.extinction_back, expected.extinction_back) < 1e-6);
    // Roots of small cosines and normals that nearly cancel enlarge the rounding of single precision.
    CHECK(distance(found.brightness, expected.brightness) < 2e-4);
  }
}

TEST_CASE("a cosine basis answers from both sides, with the normal brought back to length 1") {
  const FieldChannels channels{false, 0, SourceBasis::cosine};
  BrickGrid<float> grid({}, channels.count());
  const std::vector<float> wall{20, 0.5f, 0, 0, 0.4f, 2}, roof{20, 0.5f, 0, 0.4f, 0, 2};
  std::copy(wall.begin(), wall.end(), grid.touch_voxel({0, 0, 0}).begin());
  std::copy(roof.begin(), roof.end(), grid.touch_voxel({0, 1, 0}).begin());
  const std::vector<glm::vec3> points{{0, 0, 0}, {0, 0.5f, 0}, {0, 0, 0}};
  const std::vector<std::uint32_t> begin{0, 2, 3};
  const std::vector<glm::vec3> direction{{0, 0, -1}, {0, 0.6f, 0.8f}};
  Arrays<float> out(3, false);
  sample_field(grid.view(), channels, points, {begin, direction}, out.spans());
  CHECK(out.brightness[0] == Approx(0.5));
  CHECK(out.brightness[1] == Approx(0.25));  // the normal half-way between wall and roof
  CHECK(out.brightness[2] == Approx(0.5 * 0.64));
}

TEST_CASE("fields that do not fit their grid are refused") {
  const BrickGrid<float> grid({}, 5);
  const std::vector<glm::vec3> points(3), direction(1);
  const std::vector<std::uint32_t> begin{0, 3};
  Arrays<float> out(3, false);
  CHECK_NOTHROW(sample_field(grid.view(), {false, 1}, points, {begin, direction}, out.spans()));
  CHECK_THROWS_AS(sample_field(grid.view(), {false, 2}, points, {begin, direction}, out.spans()),
                  UsageError);
  CHECK_THROWS_AS(sample_field(grid.view(), {false, 3}, points, {begin, direction}, out.spans()),
                  UsageError);
  const std::vector<std::uint32_t> short_begin{0, 2};
  CHECK_THROWS_AS(
      sample_field(grid.view(), {false, 1}, points, {short_begin, direction}, out.spans()),
      UsageError);
  out.brightness.pop_back();
  CHECK_THROWS_AS(sample_field(grid.view(), {false, 1}, points, {begin, direction}, out.spans()),
                  UsageError);

  const FieldChannels cosine{false, 0, SourceBasis::cosine};
  BrickGrid<float> learned({}, cosine.count());
  Arrays<float> points_of_ray(3, false);
  CHECK_THROWS_AS(sample_field_adjoint(learned.view(), cosine, points, {begin, direction},
                                       points_of_ray.brightness, points_of_ray.view()),
                  UsageError);
}
