// SPDX-License-Identifier: Apache-2.0
// Operations along the lines of a sparse grid: smoothing against its own inverse, distances against closed forms.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/field/brick_lines.h"

using namespace sarnerf;

namespace {

/// All bricks of a cube, in random order.
BrickTopology cube_of_bricks(int n) {
  std::vector<glm::ivec3> bricks;
  for (int x = 0; x < n; ++x)
    for (int y = 0; y < n; ++y)
      for (int z = 0; z < n; ++z) bricks.emplace_back(x - 1, y - 1, z - 1);
  std::shuffle(bricks.begin(), bricks.end(), std::mt19937(7));
  BrickTopology topology;
  for (const glm::ivec3& b : bricks) topology.insert(b);
  return topology;
}

std::size_t index_of(const BrickTopology& topology, const glm::ivec3& voxel) {
  return std::size_t{topology.find(brick_of_voxel(voxel))} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(voxel));
}

std::vector<float> values_of(const BrickTopology& topology, const std::function<double(const glm::dvec3&)>& f) {
  std::vector<float> values(topology.n_bricks() * kBrickVoxels);
  for (std::size_t v = 0; v < values.size(); ++v) values[v] = static_cast<float>(f(glm::dvec3(topology.voxel(v))));
  return values;
}

}  // namespace

TEST_CASE("runs join neighbouring bricks along each axis, and end where one is missing") {
  BrickTopology topology;
  for (const int x : {3, 0, 1, 4}) topology.insert({x, 2, 5});
  const BrickLines lines(topology);
  REQUIRE(lines.runs(0).size() == 2);
  CHECK(lines.runs(0)[0] == std::vector<std::uint32_t>{1, 2});
  CHECK(lines.runs(0)[1] == std::vector<std::uint32_t>{0, 3});
  CHECK(lines.runs(1).size() == 4);
  CHECK(lines.runs(2).size() == 4);
}

TEST_CASE("1 - a d2 along each axis undoes smoothing") {
  const BrickTopology topology = cube_of_bricks(3);
  const BrickLines lines(topology);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const std::vector<float> before = values_of(topology, [&](const glm::dvec3&) { return uniform(random); });
  for (const double a : {0.1, 3.0, 40.0}) {
    std::vector<float> after = before;
    smooth(lines, a, after);
    // Undone in double, one axis after the other; the ends of lines have no neighbour, so the cube shrinks by a layer a side.
    std::vector<double> undone(after.begin(), after.end());
    for (int axis = 2; axis >= 0; --axis) {
      std::vector<double> next = undone;
      for (std::size_t v = 0; v < undone.size(); ++v) {
        glm::ivec3 low = topology.voxel(v), high = low;
        if (low[axis] == -8 || high[axis] == 15) continue;
        --low[axis];
        ++high[axis];
        next[v] = undone[v] - a * (undone[index_of(topology, low)] - 2.0 * undone[v] + undone[index_of(topology, high)]);
      }
      undone = next;
    }
    double worst = 0.0;
    for (std::size_t v = 0; v < undone.size(); ++v) {
      const glm::ivec3 at = topology.voxel(v);
      if (glm::any(glm::lessThan(at, glm::ivec3(-5))) || glm::any(glm::greaterThan(at, glm::ivec3(12)))) continue;
      worst = worse(worst, std::abs(undone[v] - double{before[v]}));
    }
    INFO("a = " << a);
    // float32 rounding, amplified by 1 + 4 a for each axis
    CHECK(worst < 3e-7 * std::pow(1.0 + 4.0 * a, 3.0));
  }
}

TEST_CASE("smoothing keeps sums away from borders, and does nothing for a = 0") {
  const BrickTopology topology = cube_of_bricks(3);
  const BrickLines lines(topology);
  std::vector<float> values(lines.n_voxels(), 0.0f);
  values[index_of(topology, {4, 3, 4})] = 1.0f;
  const std::vector<float> before = values;
  smooth(lines, 0.0, values);
  CHECK(values == before);
  smooth(lines, 0.5, values);
  double sum = 0.0;
  for (const float v : values) sum += double{v};
  CHECK(sum == Approx(1.0).epsilon(1e-5));
  CHECK_THROWS_AS(smooth(lines, 1.0, std::span(values).first(9)), UsageError);
}

TEST_CASE("distances to a plane are exact, whatever its slope") {
  const BrickTopology topology = cube_of_bricks(3);
  const BrickLines lines(topology);
  for (const glm::dvec3& direction : {glm::dvec3(1, 0, 0), {0.3, -1, 0.2}, {1, 1, 1}, {-0.05, 0.7, 2}}) {
    const glm::dvec3 n = glm::normalize(direction);
    const auto plane = [&](const glm::dvec3& p) { return glm::dot(n, p - glm::dvec3(3.3, 3.7, 4.1)); };
    for (const double slope : {1.0, 0.2, 7.0}) {
      std::vector<float> values = values_of(topology, [&](const glm::dvec3& p) { return slope * plane(p); });
      redistance(lines, 5.0f, values);
      double worst = 0.0, worst_near = 0.0;
      for (std::size_t v = 0; v < values.size(); ++v) {
        const glm::ivec3 at = topology.voxel(v);
        if (glm::any(glm::lessThan(at, glm::ivec3(-3))) || glm::any(glm::greaterThan(at, glm::ivec3(10)))) continue;
        const double expected = plane(glm::dvec3(at));
        const double error = std::abs(double{values[v]} - std::clamp(expected, -5.0, 5.0));
        worst = worse(worst, error);
        if (std::abs(expected) < 2.0) worst_near = worse(worst_near, error);
      }
      CHECK(worst_near < 1e-4);
      CHECK(worst < 5e-3);  // the way to the plane comes near the border, where upwind neighbours are missing
    }
  }
}

TEST_CASE("distances of a sphere, limited, with their signs") {
  const BrickTopology topology = cube_of_bricks(4);
  const BrickLines lines(topology);
  const auto sphere = [](const glm::dvec3& p) { return glm::length(p - glm::dvec3(8.2, 7.6, 8.1)) - 7.0; };
  std::vector<float> values = values_of(topology, [&](const glm::dvec3& p) { return std::clamp(3.0 * sphere(p), -4.0, 4.0); });
  redistance(lines, 4.0f, values);
  // First differences see a curved surface from outside as farther away: within a voxel by h²/2R, and further out by more.
  double worst = 0.0, worst_near = 0.0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const double expected = std::clamp(sphere(glm::dvec3(topology.voxel(v))), -4.0, 4.0);
    worst = worse(worst, std::abs(double{values[v]} - expected));
    if (std::abs(expected) < 1.0) worst_near = worse(worst_near, std::abs(double{values[v]} - expected));
    if (std::abs(expected) > 1e-3) CHECK((values[v] < 0.0f) == (expected < 0.0));
  }
  CHECK(worst_near < 0.1);
  CHECK(worst < 0.4);
}

TEST_CASE("without a surface every distance is the largest") {
  const BrickTopology topology = cube_of_bricks(1);
  const BrickLines lines(topology);
  std::vector<float> outside(lines.n_voxels(), 0.0f), inside(lines.n_voxels(), -0.1f);
  redistance(lines, 2.0f, outside);
  redistance(lines, 2.0f, inside);
  CHECK(std::ranges::all_of(outside, [](float v) { return v == 2.0f; }));
  CHECK(std::ranges::all_of(inside, [](float v) { return v == -2.0f; }));
}
