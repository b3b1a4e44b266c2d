// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/trilinear.h"

#include <array>

#include "cell.h"
#include "check_field.h"

namespace sarnerf {
namespace {

bool in_one_brick(const glm::ivec3& voxel) {
  return (voxel.x & 7) != 7 && (voxel.y & 7) != 7 && (voxel.z & 7) != 7;
}

/// Weights of the four pairs of corners that differ in z; each pair lies side by side in memory.
std::array<float, 4> pair_weights(const glm::vec3& f) {
  const float x0 = 1.0f - f.x, y0 = 1.0f - f.y;
  return {x0 * y0, x0 * f.y, f.x * y0, f.x * f.y};
}

/// Voxels between the first pair of corners and the others.
constexpr int kPairOffset[4] = {0, kBrickSide, kBrickSide * kBrickSide,
                                kBrickSide * kBrickSide + kBrickSide};

/// The four pairs of a cell within one brick.
template <class T>
std::array<T*, 4> pairs_of(const BrickView<T>& grid, std::uint32_t brick, const glm::ivec3& voxel) {
  const int offset = offset_in_brick(voxel);
  return {grid.voxel(brick, offset + kPairOffset[0]), grid.voxel(brick, offset + kPairOffset[1]),
          grid.voxel(brick, offset + kPairOffset[2]), grid.voxel(brick, offset + kPairOffset[3])};
}

/// The eight corners of a cell that reaches into other bricks: null where there is none. Bricks are
/// looked up only for the sides on which the cell crosses a border.
template <class T>
std::array<T*, 8> corners_of(const BrickView<T>& grid, BrickFinder& finder, const glm::ivec3& voxel) {
  std::array<std::uint32_t, 8> brick;
  std::array<T*, 8> corners;
  const int crossed = ((voxel.x & 7) == 7) * 4 + ((voxel.y & 7) == 7) * 2 + ((voxel.z & 7) == 7);
  for (int n = 0; n < 8; ++n) {
    const glm::ivec3 corner = voxel + corner_step(n);
    const auto here = static_cast<std::size_t>(n);
    const auto same = static_cast<std::size_t>(n & crossed);  // the first corner in this one's brick
    brick[here] = same == here ? finder.find(brick_of_voxel(corner)) : brick[same];
    corners[here] = brick[here] == kNoBrick ? nullptr : grid.voxel(brick[here], offset_in_brick(corner));
  }
  return corners;
}

/// kChannels is the number of channels, or 0 if only `n` knows it. Known, and with results in local
/// arrays that alias nothing, the loops become a few vector instructions.
template <int kChannels>
void mix_pairs(const std::array<const float*, 4>& pair, const std::array<float, 4>& weight, float z,
               std::size_t n, float* __restrict out) {
  if constexpr (kChannels > 0) {
    std::array<float, 2 * kChannels> both;
    for (std::size_t c = 0; c < both.size(); ++c) {
      both[c] = weight[0] * pair[0][c] + weight[1] * pair[1][c] + weight[2] * pair[2][c] +
                weight[3] * pair[3][c];
    }
    for (std::size_t c = 0; c < kChannels; ++c) {
      out[c] = (1.0f - z) * both[c] + z * both[c + kChannels];
    }
  } else {
    for (std::size_t c = 0; c < n; ++c) {
      const float near = weight[0] * pair[0][c] + weight[1] * pair[1][c] + weight[2] * pair[2][c] +
                         weight[3] * pair[3][c];
      const float far = weight[0] * pair[0][c + n] + weight[1] * pair[1][c + n] +
                        weight[2] * pair[2][c + n] + weight[3] * pair[3][c + n];
      out[c] = (1.0f - z) * near + z * far;
    }
  }
}

template <int kChannels>
void add_to_pairs(const std::array<float*, 4>& pair, const std::array<float, 4>& weight, float z,
                  std::size_t n, const float* __restrict in) {
  if constexpr (kChannels > 0) {
    std::array<float, 2 * kChannels> both;
    for (std::size_t c = 0; c < kChannels; ++c) {
      both[c] = (1.0f - z) * in[c];
      both[c + kChannels] = z * in[c];
    }
    for (std::size_t p = 0; p < 4; ++p) {
      float* __restrict const voxels = pair[p];
      for (std::size_t c = 0; c < both.size(); ++c) voxels[c] += weight[p] * both[c];
    }
  } else {
    for (std::size_t p = 0; p < 4; ++p) {
      float* __restrict const voxels = pair[p];
      for (std::size_t c = 0; c < n; ++c) {
        voxels[c] += weight[p] * ((1.0f - z) * in[c]);
        voxels[c + n] += weight[p] * (z * in[c]);
      }
    }
  }
}

template <int kChannels>
void sample(const BrickView<const float>& grid, std::span<const glm::vec3> points_m, float* out) {
  const auto n_channels = static_cast<std::size_t>(kChannels > 0 ? kChannels : grid.n_channels);
  const CellFinder cells(grid.transform);
  BrickFinder finder(*grid.topology);
  for (const glm::vec3& point_m : points_m) {
    const Cell cell = cells.at(glm::dvec3(point_m));
    const glm::vec3 f(cell.fraction);
    const std::array<float, 4> weight = pair_weights(f);
    if (cell.valid && in_one_brick(cell.voxel)) {
      const std::uint32_t brick = finder.find(brick_of_voxel(cell.voxel));
      if (brick != kNoBrick) {
        mix_pairs<kChannels>(pairs_of(grid, brick, cell.voxel), weight, f.z, n_channels, out);
      } else {
        for (std::size_t c = 0; c < n_channels; ++c) out[c] = 0.0f;
      }
    } else {
      for (std::size_t c = 0; c < n_channels; ++c) out[c] = 0.0f;
      const std::array<const float*, 8> corners =
          cell.valid ? corners_of(grid, finder, cell.voxel) : std::array<const float*, 8>{};
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
  const CellFinder cells(grid.transform);
  BrickFinder finder(*grid.topology);
  for (const glm::vec3& point_m : points_m) {
    const Cell cell = cells.at(glm::dvec3(point_m));
    const glm::vec3 f(cell.fraction);
    const std::array<float, 4> weight = pair_weights(f);
    if (cell.valid && in_one_brick(cell.voxel)) {
      const std::uint32_t brick = finder.find(brick_of_voxel(cell.voxel));
      if (brick != kNoBrick) {
        add_to_pairs<kChannels>(pairs_of(grid, brick, cell.voxel), weight, f.z, n_channels, in);
      }
    } else if (cell.valid) {
      const std::array<float*, 8> corners = corners_of(grid, finder, cell.voxel);
      for (std::size_t n = 0; n < 8; ++n) {
        if (!corners[n]) continue;
        const float w = weight[n / 2] * (n % 2 ? f.z : 1.0f - f.z);
        for (std::size_t c = 0; c < n_channels; ++c) corners[n][c] += w * in[c];
      }
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
