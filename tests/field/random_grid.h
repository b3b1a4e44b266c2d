// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <random>
#include <vector>

#include "sarnerf/field/brick_grid.h"

namespace sarnerf::test {

/// Bricks around the origin, negative ones included, about two thirds of a 4 × 3 × 4 block.
inline BrickGrid<double> random_grid(unsigned seed, int n_channels) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  BrickGrid<double> grid({{-0.3, 1.7, 0.45}, 0.37}, n_channels);
  for (int x = -2; x < 2; ++x) {
    for (int y = -2; y < 1; ++y) {
      for (int z = -2; z < 2; ++z) {
        if (unit(random) < 0.66) grid.touch_brick({x, y, z});
      }
    }
  }
  for (double& value : grid.view().values) value = static_cast<float>(unit(random) - 0.4);
  return grid;
}

inline BrickGrid<float> as_float(const BrickGrid<double>& grid) {
  BrickGrid<float> result(grid.transform(), grid.n_channels());
  for (std::uint32_t n = 0; n < grid.topology().n_bricks(); ++n) {
    result.touch_brick(grid.topology().coordinate(n));
  }
  const auto values = grid.view().values;
  for (std::size_t n = 0; n < values.size(); ++n) {
    result.view().values[n] = static_cast<float>(values[n]);
  }
  return result;
}

/// Points in and around the block, many of them close to borders of bricks.
inline std::vector<glm::vec3> random_points(unsigned seed, std::size_t n,
                                            const GridTransform& transform) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<glm::vec3> points(n);
  for (glm::vec3& point : points) {
    const glm::dvec3 index(40 * unit(random) - 20, 32 * unit(random) - 20, 40 * unit(random) - 20);
    point = glm::vec3(transform.world_from_index(index));
  }
  return points;
}

template <class T>
std::vector<T> random_values(unsigned seed, std::size_t n) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> symmetric(-1.0, 1.0);
  std::vector<T> values(n);
  for (T& value : values) value = static_cast<T>(symmetric(random));
  return values;
}

template <class To, class From>
std::vector<To> converted(const std::vector<From>& from) {
  return std::vector<To>(from.begin(), from.end());
}

}  // namespace sarnerf::test
