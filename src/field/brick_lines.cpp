// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/brick_lines.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {

namespace {

/// Lines of a run of bricks, which are processed side by side.
constexpr std::size_t kLines = kBrickSide * kBrickSide;
/// One voxel of each line.
using Layer = std::array<float, kLines>;

/// Offset in its brick of line `line`'s voxel in layer `layer` of a brick, for lines along `axis`.
constexpr std::size_t offset_of(int axis, std::size_t layer, std::size_t line) {
  const std::size_t u = line / kBrickSide, v = line % kBrickSide;
  if (axis == 0) return (layer * kBrickSide + u) * kBrickSide + v;
  if (axis == 1) return (u * kBrickSide + layer) * kBrickSide + v;
  return (u * kBrickSide + v) * kBrickSide + layer;
}

void gather(std::span<const std::uint32_t> run, int axis, std::span<const float> values, std::vector<Layer>& layers) {
  layers.resize(run.size() * kBrickSide);
  for (std::size_t b = 0; b < run.size(); ++b) {
    const float* const brick = &values[std::size_t{run[b]} * kBrickVoxels];
    for (std::size_t layer = 0; layer < kBrickSide; ++layer)
      for (std::size_t line = 0; line < kLines; ++line)
        layers[b * kBrickSide + layer][line] = brick[offset_of(axis, layer, line)];
  }
}

void scatter(std::span<const std::uint32_t> run, int axis, const std::vector<Layer>& layers, std::span<float> values) {
  for (std::size_t b = 0; b < run.size(); ++b) {
    float* const brick = &values[std::size_t{run[b]} * kBrickVoxels];
    for (std::size_t layer = 0; layer < kBrickSide; ++layer)
      for (std::size_t line = 0; line < kLines; ++line)
        brick[offset_of(axis, layer, line)] = layers[b * kBrickSide + layer][line];
  }
}

void check_size(const BrickLines& lines, std::size_t n) {
  if (n != lines.n_voxels()) throw UsageError("values must be as many as the voxels of the bricks");
}

constexpr std::size_t kRunsAtATime = 4;

}  // namespace

BrickLines::BrickLines(const BrickTopology& topology) : n_voxels_(topology.n_bricks() * kBrickVoxels) {
  std::vector<std::uint32_t> numbers(topology.n_bricks());
  std::iota(numbers.begin(), numbers.end(), 0u);
  for (const std::uint32_t b : numbers) {
    coordinates_.push_back(topology.coordinate(b));
    auto& around = neighbours_.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 step(0);
      step[axis] = 1;
      around[static_cast<std::size_t>(2 * axis)] = topology.find(coordinates_[b] - step);
      around[static_cast<std::size_t>(2 * axis + 1)] = topology.find(coordinates_[b] + step);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto key = [&](std::uint32_t b) {
      const glm::ivec3& c = topology.coordinate(b);
      return std::tuple(c[(axis + 1) % 3], c[(axis + 2) % 3], c[axis]);
    };
    std::ranges::sort(numbers, {}, key);
    auto& runs = runs_[static_cast<std::size_t>(axis)];
    for (std::size_t n = 0; n < numbers.size(); ++n) {
      glm::ivec3 before = topology.coordinate(numbers[n]);
      --before[axis];
      if (n == 0 || topology.coordinate(numbers[n - 1]) != before) runs.emplace_back();
      runs.back().push_back(numbers[n]);
    }
  }
}

std::vector<std::uint32_t> BrickLines::in_order(const glm::ivec3& direction) const {
  std::vector<std::uint32_t> order(coordinates_.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, {}, [&](std::uint32_t b) {
    const glm::ivec3 c = direction * coordinates_[b];
    return std::tuple(c.x, c.y, c.z);
  });
  return order;
}

void smooth(const BrickLines& lines, double voxels2, std::span<float> values) {
  check_size(lines, values.size());
  if (!(voxels2 > 0.0)) return;
  // (1 − a δ²)⁻¹ with δ² the second difference is the two-sided exponential c q^|n|.
  const double half = 1.0 + 0.5 / voxels2;
  const double q = half - std::sqrt(half * half - 1.0), c = (1.0 - q) / (1.0 + q);
  const auto ratio = static_cast<float>(q), scale = static_cast<float>(c);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& runs = lines.runs(axis);
    parallel_for(runs.size(), kRunsAtATime, [&](std::size_t begin, std::size_t end, int) {
      std::vector<Layer> in, sum;
      for (std::size_t r = begin; r < end; ++r) {
        gather(runs[r], axis, values, in);
        sum.resize(in.size());
        Layer past{};
        for (std::size_t n = 0; n < in.size(); ++n) {
          for (std::size_t l = 0; l < kLines; ++l) sum[n][l] = past[l] = in[n][l] + ratio * past[l];
        }
        past = {};
        for (std::size_t n = in.size(); n-- > 0;) {
          for (std::size_t l = 0; l < kLines; ++l) {
            const float behind = ratio * past[l];
            sum[n][l] = scale * (sum[n][l] + behind);
            past[l] = in[n][l] + behind;
          }
        }
        scatter(runs[r], axis, sum, values);
      }
    });
  }
}

namespace {

constexpr float kFar = 1e9f;

/// What the values fall by towards the surface, as a part of the value: the inverse of the way to it along an axis, in voxels;
/// 0 where they do not fall. A part above 1 passes through the surface.
std::vector<float> falls(const BrickLines& lines, int axis, std::span<const float> distance) {
  constexpr float kLeast = 1e-6f;
  std::vector<float> fall(distance.size(), 0.0f);
  const auto& runs = lines.runs(axis);
  parallel_for(runs.size(), kRunsAtATime, [&](std::size_t begin, std::size_t end, int) {
    std::vector<Layer> f, part;
    const auto take = [&](std::size_t at, std::size_t next) {
      for (std::size_t l = 0; l < kLines; ++l) {
        const float here = std::copysign(std::max(std::abs(f[at][l]), kLeast), f[at][l]);
        part[at][l] = std::max(part[at][l], 1.0f - f[next][l] / here);
      }
    };
    for (std::size_t r = begin; r < end; ++r) {
      gather(runs[r], axis, distance, f);
      part.assign(f.size(), {});
      for (std::size_t n = 0; n + 1 < f.size(); ++n) {
        take(n, n + 1);
        take(n + 1, n);
      }
      scatter(runs[r], axis, part, fall);
    }
  });
  return fall;
}

/// Distances of voxels with a neighbour of the other sign: to the plane that the slopes towards the surface define. kFar for others.
std::vector<float> next_to_surface(const BrickLines& lines, std::span<const float> distance) {
  std::array<std::vector<float>, 3> fall;
  for (int axis = 0; axis < 3; ++axis) fall[static_cast<std::size_t>(axis)] = falls(lines, axis, distance);
  std::vector<float> next(distance.size(), kFar);
  for (std::size_t v = 0; v < next.size(); ++v) {
    float sum = 0.0f, most = 0.0f;
    for (const std::vector<float>& part : fall) {
      sum += part[v] * part[v];
      most = std::max(most, part[v]);
    }
    if (most > 1.0f) next[v] = 1.0f / std::sqrt(sum);
  }
  return next;
}

/// The distance of a point from the nearest distances of its neighbours along each axis: the upwind solution of |∇u| = 1.
float upwind(float a, float b, float c) {
  if (a > b) std::swap(a, b);
  if (b > c) std::swap(b, c);
  if (a > b) std::swap(a, b);
  float u = a + 1.0f;
  if (u <= b) return u;
  u = 0.5f * (a + b + std::sqrt(std::max(0.0f, 2.0f - (a - b) * (a - b))));
  if (u <= c) return u;
  const float sum = a + b + c;
  return (sum + std::sqrt(std::max(0.0f, sum * sum - 3.0f * (a * a + b * b + c * c - 1.0f)))) / 3.0f;
}

/// One sweep through all voxels in the order of `direction` (each ±1), through each brick as a whole.
void sweep(const BrickLines& lines, const glm::ivec3& direction, std::span<const float> fixed, std::span<float> u) {
  const auto at = [&](const std::array<std::uint32_t, 6>& around, std::uint32_t brick, glm::ivec3 voxel, int axis, int side) {
    voxel[axis] += side;
    if (voxel[axis] < 0 || voxel[axis] >= kBrickSide) {
      brick = around[static_cast<std::size_t>(2 * axis + (side > 0))];
      if (brick == kNoBrick) return kFar;
      voxel[axis] &= kBrickSide - 1;
    }
    return u[std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(voxel))];
  };
  for (const std::uint32_t brick : lines.in_order(direction)) {
    const auto& around = lines.neighbours(brick);
    for (int n = 0; n < kBrickVoxels; ++n) {
      glm::ivec3 voxel = voxel_in_brick(n);
      for (int axis = 0; axis < 3; ++axis)
        if (direction[axis] < 0) voxel[axis] = kBrickSide - 1 - voxel[axis];
      const std::size_t v = std::size_t{brick} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(voxel));
      if (fixed[v] < kFar) continue;
      std::array<float, 3> least;
      for (int axis = 0; axis < 3; ++axis)
        least[static_cast<std::size_t>(axis)] = std::min(at(around, brick, voxel, axis, -1), at(around, brick, voxel, axis, 1));
      if (std::min({least[0], least[1], least[2]}) < kFar) u[v] = std::min(u[v], upwind(least[0], least[1], least[2]));
    }
  }
}

}  // namespace

void redistance(const BrickLines& lines, float most, std::span<float> distance) {
  check_size(lines, distance.size());
  const std::vector<float> fixed = next_to_surface(lines, distance);
  std::vector<float> u = fixed;
  for (int corner = 0; corner < 8; ++corner)
    sweep(lines, {corner & 1 ? -1 : 1, corner & 2 ? -1 : 1, corner & 4 ? -1 : 1}, fixed, u);
  for (std::size_t v = 0; v < distance.size(); ++v) {
    const float far = std::min(most, u[v]);
    distance[v] = distance[v] < 0.0f ? -far : far;
  }
}

}  // namespace sarnerf
