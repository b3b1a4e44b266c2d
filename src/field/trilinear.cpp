// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/trilinear.h"

#include <array>

#include "cell.h"
#include "check_field.h"

namespace sarnerf {
namespace {

/// Finds bricks for points that follow one another along rays: mostly the same as the last time.
class BrickFinder {
 public:
  explicit BrickFinder(const BrickTopology& topology) : topology_(topology) {}

  std::uint32_t find(const glm::ivec3& brick) {
    if (brick != last_) {
      last_ = brick;
      number_ = topology_.find(brick);
    }
    return number_;
  }

 private:
  const BrickTopology& topology_;
  glm::ivec3 last_{0x7fffffff};  // no voxel within reach has this brick
  std::uint32_t number_ = kNoBrick;
};

bool in_one_brick(const glm::ivec3& voxel) {
  return (voxel.x & 7) != 7 && (voxel.y & 7) != 7 && (voxel.z & 7) != 7;
}

/// Weights of the four pairs of corners that differ in z; each pair lies side by side in memory.
std::array<float, 4> pair_weights(const glm::vec3& f) {
  const float x0 = 1.0f - f.x, y0 = 1.0f - f.y;
  return {x0 * y0, x0 * f.y, f.x * y0, f.x * f.y};
}

/// Voxels between the first pair of corners and the others.
constexpr std::array<int, 4> kPairOffset{0, kBrickSide, kBrickSide* kBrickSide,
                                         kBrickSide* kBrickSide + kBrickSide};

/// Corners of a cell that reaches into other bricks: null where there is none. Few bricks are
/// looked up: only the sides on which the cell crosses a border.
template <class T>
std::array<T*, 8> corners_of(const BrickView<T>& grid, const glm::ivec3& voxel) {
  std::array<std::uint32_t, 8> brick;
  std::array<T*, 8> corners;
  const glm::ivec3 crosses{(voxel.x & 7) == 7, (voxel.y & 7) == 7, (voxel.z & 7) == 7};
  for (int n = 0; n < 8; ++n) {
    const glm::ivec3 step = corner_step(n);
    const glm::ivec3 over = step * crosses;
    const int same = over.x * 4 + over.y * 2 + over.z;
    const auto here = static_cast<std::size_t>(n);
    brick[here] = same == n ? grid.topology->find(brick_of_voxel(voxel + step))
                            : brick[static_cast<std::size_t>(same)];
    corners[here] =
        brick[here] == kNoBrick ? nullptr : grid.voxel(brick[here], offset_in_brick(voxel + step));
  }
  return corners;
}

/// kChannels is the number of channels, or 0 if it is only known at run time.
template <int kChannels>
void sample(const BrickView<const float>& grid, std::span<const glm::vec3> points_m, float* out) {
  const auto n_channels = static_cast<std::size_t>(kChannels > 0 ? kChannels : grid.n_channels);
  BrickFinder finder(*grid.topology);
  for (const glm::vec3& point_m : points_m) {
    const Cell cell = cell_at(grid.transform, glm::dvec3(point_m));
    const glm::vec3 f(cell.fraction);
    const std::array<float, 4> weight = pair_weights(f);
    for (std::size_t c = 0; c < n_channels; ++c) out[c] = 0.0f;
    if (cell.valid && in_one_brick(cell.voxel)) {
      const std::uint32_t brick = finder.find(brick_of_voxel(cell.voxel));
      if (brick != kNoBrick) {
        const float* const pair[4] = {
            grid.voxel(brick, offset_in_brick(cell.voxel) + kPairOffset[0]),
            grid.voxel(brick, offset_in_brick(cell.voxel) + kPairOffset[1]),
            grid.voxel(brick, offset_in_brick(cell.voxel) + kPairOffset[2]),
            grid.voxel(brick, offset_in_brick(cell.voxel) + kPairOffset[3])};
        const auto at = [&](std::size_t n) {
          return weight[0] * pair[0][n] + weight[1] * pair[1][n] + weight[2] * pair[2][n] +
                 weight[3] * pair[3][n];
        };
        for (std::size_t c = 0; c < n_channels; ++c) {
          out[c] = (1.0f - f.z) * at(c) + f.z * at(n_channels + c);
        }
      }
    } else if (cell.valid) {
      const std::array<const float*, 8> corners = corners_of(grid, cell.voxel);
      for (std::size_t n = 0; n < 8; ++n) {
        if (!corners[n]) continue;
        const float w = weight[n / 2] * (n % 2 ? f.z : 1.0f - f.z);
        for (std::size_t c = 0; c < n_channels; ++c) out[c] += w * corners[n][c];
      }
    }
    out += n_channels;
  }
}

template <int kChannels>
void scatter(const BrickView<float>& grid, std::span<const glm::vec3> points_m, const float* in) {
  const auto n_channels = static_cast<std::size_t>(kChannels > 0 ? kChannels : grid.n_channels);
  BrickFinder finder(*grid.topology);
  for (const glm::vec3& point_m : points_m) {
    const Cell cell = cell_at(grid.transform, glm::dvec3(point_m));
    const glm::vec3 f(cell.fraction);
    const std::array<float, 4> weight = pair_weights(f);
    std::array<float*, 8> corners{};
    if (cell.valid && in_one_brick(cell.voxel)) {
      const std::uint32_t brick = finder.find(brick_of_voxel(cell.voxel));
      for (std::size_t n = 0; n < 8 && brick != kNoBrick; ++n) {
        corners[n] = grid.voxel(brick, offset_in_brick(cell.voxel) + kPairOffset[n / 2] +
                                           static_cast<int>(n % 2));
      }
    } else if (cell.valid) {
      corners = corners_of(grid, cell.voxel);
    }
    for (std::size_t n = 0; n < 8; ++n) {
      if (!corners[n]) continue;
      const float w = weight[n / 2] * (n % 2 ? f.z : 1.0f - f.z);
      for (std::size_t c = 0; c < n_channels; ++c) corners[n][c] += w * in[c];
    }
    in += n_channels;
  }
}

/// Calls f.operator()<kChannels>() for the numbers of channels that fields have: one or two extinctions
/// with 1, 4 or 9 harmonics, or an extinction alone.
template <class F>
void with_channels(int n_channels, F&& f) {
  switch (n_channels) {
    case 1: return f.template operator()<1>();
    case 2: return f.template operator()<2>();
    case 3: return f.template operator()<3>();
    case 5: return f.template operator()<5>();
    case 6: return f.template operator()<6>();
    case 10: return f.template operator()<10>();
    case 11: return f.template operator()<11>();
    default: return f.template operator()<0>();
  }
}

}  // namespace

void sample_trilinear(const BrickView<const float>& grid, std::span<const glm::vec3> points_m,
                      std::span<float> samples) {
  check_samples(grid, points_m.size(), samples.size());
  with_channels(grid.n_channels,
                [&]<int kChannels>() { sample<kChannels>(grid, points_m, samples.data()); });
}

void scatter_trilinear(const BrickView<float>& grid_gradients, std::span<const glm::vec3> points_m,
                       std::span<const float> sample_gradients) {
  check_samples<float>(grid_gradients, points_m.size(), sample_gradients.size());
  with_channels(grid_gradients.n_channels, [&]<int kChannels>() {
    scatter<kChannels>(grid_gradients, points_m, sample_gradients.data());
  });
}

}  // namespace sarnerf
