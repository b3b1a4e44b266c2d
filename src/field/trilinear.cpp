// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <type_traits>
#include <vector>

#include <glm/glm.hpp>

#include "check_field.h"
#include "sarnerf/core/error.h"
#include "sarnerf/field/brick_grid.h"
#include "sarnerf/field/field_sampler.h"

namespace sarnerf {

namespace {

/// Cells of eight voxels around a block of points: the lowest of the eight, and the point's position within
/// the cell. Each component has its own array, so that the loops that fill them are vectorised.
struct Cells {
  static constexpr std::size_t kCapacity = 128;
  std::array<int, kCapacity> voxel[3];
  std::array<float, kCapacity> fraction[3];
};

/// One coordinate of the cells. Points that are not finite or too far away get a cell beyond kMaxBrick, where no
/// brick can be.
inline void find_cells_along(double origin_m, double voxels_per_m,
                             const float* __restrict coordinate_m, std::size_t n_points,
                             int* __restrict voxel, float* __restrict fraction) {
  constexpr double kBeyond = 8.0 * (kMaxBrick + 2);
  for (std::size_t n = 0; n < n_points; ++n) {
    const double exact = (static_cast<double>(coordinate_m[n]) - origin_m) * voxels_per_m;
    const double index = std::abs(exact) < kBeyond ? exact : kBeyond;  // also for NaN
    // Replaces std::floor, which is a call on processors before SSE 4.1 and prevents vectorisation of the loop:
    // adding 1.5 · 2⁵² rounds to the nearest integer.
    const double nearest = (index + 0x1.8p52) - 0x1.8p52;
    const double low = index < nearest ? nearest - 1.0 : nearest;
    voxel[n] = static_cast<int>(low);
    fraction[n] = static_cast<float>(index - low);
  }
}

inline void find_cells(const GridTransform& transform, std::span<const glm::vec3> points_m,
                       Cells& cells) {
  std::array<float, Cells::kCapacity> coordinate_m[3];
  for (std::size_t n = 0; n < points_m.size(); ++n) {
    coordinate_m[0][n] = points_m[n].x;
    coordinate_m[1][n] = points_m[n].y;
    coordinate_m[2][n] = points_m[n].z;
  }
  const double origin_m[3] = {transform.origin_m.x, transform.origin_m.y, transform.origin_m.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    find_cells_along(origin_m[axis], 1.0 / transform.voxel_size_m, coordinate_m[axis].data(),
                     points_m.size(), cells.voxel[axis].data(), cells.fraction[axis].data());
  }
}

/// Weights of the four pairs of corners; the two of a pair differ in z and are adjacent in memory.
std::array<float, 4> pair_weights(const glm::vec3& f) {
  const float x0 = 1.0f - f.x, y0 = 1.0f - f.y;
  return {x0 * y0, x0 * f.y, f.x * y0, f.x * f.y};
}

/// Sides on which a cell reaches into the next brick, as bits of an index into BrickTopology::Neighbours.
int crossed_sides(const glm::ivec3& voxel) {
  return ((voxel.x & 7) == 7) * 4 + ((voxel.y & 7) == 7) * 2 + ((voxel.z & 7) == 7);
}

/// Offset in its brick of corner n of a cell; z is the lowest bit of n.
int corner_offset(const glm::ivec3& voxel, int n) {
  return offset_in_brick({voxel.x + (n >> 2), voxel.y + (n >> 1 & 1), voxel.z + (n & 1)});
}

/// The first voxels of the four pairs of a cell that does not cross the border in z; `nothing` replaces
/// voxels of missing bricks. Free of branches, because the borders that are crossed are unpredictable.
template <class T>
[[gnu::always_inline]] inline std::array<T*, 4> pairs_of(const BrickView<T>& grid,
                                                         const BrickTopology::Neighbours& bricks,
                                                         const glm::ivec3& voxel, T* nothing) {
  const int crossed = crossed_sides(voxel);
  std::array<T*, 4> pairs;
  for (int p = 0; p < 4; ++p) {
    const std::uint32_t brick = bricks[static_cast<std::size_t>(2 * p & crossed)];
    T* const voxels = grid.voxel(brick == kNoBrick ? 0 : brick, corner_offset(voxel, 2 * p));
    pairs[static_cast<std::size_t>(p)] = brick == kNoBrick ? nothing : voxels;
  }
  return pairs;
}

/// The eight corners of any other cell; null for voxels of missing bricks.
template <class T>
std::array<T*, 8> corners_of(const BrickView<T>& grid, BrickFinder& finder,
                             const glm::ivec3& voxel) {
  const int crossed = crossed_sides(voxel);
  const glm::ivec3 first = brick_of_voxel(voxel);
  const std::uint32_t own = finder.find(first);
  BrickTopology::Neighbours bricks;
  if (own != kNoBrick) {
    bricks = grid.topology->neighbours(own);
  } else {
    for (int n = 0; n < 8; ++n) {
      const bool needed = (n & crossed) == n;
      bricks[static_cast<std::size_t>(n)] =
          needed ? finder.find(first + glm::ivec3(n >> 2, n >> 1 & 1, n & 1)) : kNoBrick;
    }
  }
  std::array<T*, 8> corners;
  for (int n = 0; n < 8; ++n) {
    const std::uint32_t brick = bricks[static_cast<std::size_t>(n & crossed)];
    corners[static_cast<std::size_t>(n)] =
        brick == kNoBrick ? nullptr : grid.voxel(brick, corner_offset(voxel, n));
  }
  return corners;
}

/// The same grid. If kChannels is not 0, it is the number of channels, which is then known to the compiler.
template <int kChannels, class T>
BrickView<T> with_known_channels(BrickView<T> grid) {
  if (kChannels > 0) grid.n_channels = kChannels;
  return grid;
}

/// Points whose voxels are looked up and prefetched before the first is read or written: few enough for the voxels
/// to stay in the first level cache.
constexpr std::size_t kBlockPoints = 32;

/// The voxels around a point.
template <class T>
struct Place {
  std::array<T*, 8> voxels;  ///< four pairs, or eight corners; corners without a brick are null
  bool in_pairs;
};

/// Prefetches the values of one or two voxels while others are processed. No processor predicts the bricks that a
/// ray meets next, and waiting for each in turn takes as long as everything else.
template <class T>
void prefetch(T* values, std::size_t n) {
  constexpr bool kToWrite = !std::is_const_v<T>;
  __builtin_prefetch(values, kToWrite);
  __builtin_prefetch(values + n - 1, kToWrite);
}

/// Calls visit(place, fraction) for each point in turn; `nothing` replaces two voxels of a missing brick.
template <class T, class Visit>
void for_each_place(const BrickView<T>& grid, BrickFinder& finder, std::span<const glm::vec3> points_m, T* nothing,
                    Visit&& visit) {
  const auto n_channels = static_cast<std::size_t>(grid.n_channels);
  Cells cells;
  std::array<Place<T>, kBlockPoints> places;
  for (std::size_t begin = 0; begin < points_m.size(); begin += kBlockPoints) {
    const std::size_t n_points = std::min(kBlockPoints, points_m.size() - begin);
    find_cells(grid.transform, points_m.subspan(begin, n_points), cells);
    for (std::size_t n = 0; n < n_points; ++n) {
      const glm::ivec3 voxel(cells.voxel[0][n], cells.voxel[1][n], cells.voxel[2][n]);
      const std::uint32_t brick = finder.find(brick_of_voxel(voxel));
      Place<T>& place = places[n];
      place.in_pairs = brick != kNoBrick && (voxel.z & 7) != 7;
      if (place.in_pairs) {
        const std::array<T*, 4> pairs = pairs_of(grid, grid.topology->neighbours(brick), voxel, nothing);
        for (std::size_t p = 0; p < 4; ++p) {
          place.voxels[p] = pairs[p];
          prefetch(pairs[p], 2 * n_channels);
        }
      } else if (brick != kNoBrick || crossed_sides(voxel) != 0) {
        place.voxels = corners_of(grid, finder, voxel);
        for (T* corner : place.voxels) {
          if (corner) prefetch(corner, n_channels);
        }
      } else {
        place.voxels.fill(nullptr);
      }
    }
    for (std::size_t n = 0; n < n_points; ++n)
      visit(places[n], glm::vec3(cells.fraction[0][n], cells.fraction[1][n], cells.fraction[2][n]));
  }
}

/// The four pairs of a place with `in_pairs`.
template <class T>
std::array<T*, 4> pairs(const Place<T>& place) {
  return {place.voxels[0], place.voxels[1], place.voxels[2], place.voxels[3]};
}

/// kChannels is the number of channels, or 0 if it is given by `n` at run time. With a constant number, and with
/// results in local arrays that alias nothing, the loops become a few vector instructions.
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

/// The weight of corner n: that of its pair times that of its side in z.
float corner_weight(const std::array<float, 4>& weight, float z, std::size_t n) {
  return weight[n / 2] * (n % 2 ? z : 1.0f - z);
}

template <int kChannels>
void sample(const BrickView<const float>& any_grid, BrickFinder& finder,
            std::span<const glm::vec3> points_m, const float* zeros, float* __restrict out) {
  const BrickView<const float> grid = with_known_channels<kChannels>(any_grid);
  const auto n_channels = static_cast<std::size_t>(grid.n_channels);
  const auto visit = [&](const Place<const float>& place, const glm::vec3& f) {
    const std::array<float, 4> weight = pair_weights(f);
    if (place.in_pairs) {
      mix_pairs<kChannels>(pairs(place), weight, f.z, n_channels, out);
    } else {
      for (std::size_t c = 0; c < n_channels; ++c) out[c] = 0.0f;
      for (std::size_t n = 0; n < 8; ++n) {
        if (!place.voxels[n]) continue;
        const float w = corner_weight(weight, f.z, n);
        for (std::size_t c = 0; c < n_channels; ++c) out[c] += w * place.voxels[n][c];
      }
    }
    out += n_channels;
  };
  for_each_place(grid, finder, points_m, zeros, visit);
}

template <int kChannels>
void scatter(const BrickView<float>& any_grid, std::span<const glm::vec3> points_m,
             const float* __restrict in) {
  const BrickView<float> grid = with_known_channels<kChannels>(any_grid);
  const auto n_channels = static_cast<std::size_t>(grid.n_channels);
  std::vector<float> nowhere(2 * n_channels, 0.0f);
  BrickFinder finder(*grid.topology);
  const auto visit = [&](const Place<float>& place, const glm::vec3& f) {
    const std::array<float, 4> weight = pair_weights(f);
    if (place.in_pairs) {
      add_to_pairs<kChannels>(pairs(place), weight, f.z, n_channels, in);
    } else {
      for (std::size_t n = 0; n < 8; ++n) {
        if (!place.voxels[n]) continue;
        const float w = corner_weight(weight, f.z, n);
        for (std::size_t c = 0; c < n_channels; ++c) place.voxels[n][c] += w * in[c];
      }
    }
    in += n_channels;
  };
  for_each_place(grid, finder, points_m, nowhere.data(), visit);
}

/// The eight corners of a place in a grid of one channel; null where there is no brick.
template <class T>
std::array<T*, 8> corners(const Place<T>& place) {
  if (!place.in_pairs) return place.voxels;
  std::array<T*, 8> of_pairs;
  for (std::size_t n = 0; n < 8; ++n) of_pairs[n] = place.voxels[n / 2] + n % 2;
  return of_pairs;
}

/// Derivative of the weight of corner n by each coordinate, in voxels.
glm::vec3 weight_slope(const glm::vec3& f, std::size_t n) {
  const bool x = n & 4, y = n & 2, z = n & 1;
  const float wx = x ? f.x : 1.0f - f.x, wy = y ? f.y : 1.0f - f.y, wz = z ? f.z : 1.0f - f.z;
  return {(x ? 1.0f : -1.0f) * wy * wz, wx * (y ? 1.0f : -1.0f) * wz, wx * wy * (z ? 1.0f : -1.0f)};
}

/// Calls f.operator()<kChannels>() with the number of channels if it is one of the usual ones (one or two
/// extinctions with 1, 4 or 9 harmonics, an extinction or 9 harmonics alone), else with 0.
template <class F>
void with_channels(int n_channels, F&& f) {
  switch (n_channels) {
    case 1:
      return f.template operator()<1>();
    case 2:
      return f.template operator()<2>();
    case 3:
      return f.template operator()<3>();
    case 5:
      return f.template operator()<5>();
    case 6:
      return f.template operator()<6>();
    case 9:
      return f.template operator()<9>();
    case 10:
      return f.template operator()<10>();
    case 11:
      return f.template operator()<11>();
    default:
      return f.template operator()<0>();
  }
}

}  // namespace

void sample_trilinear(const BrickView<const float>& grid, std::span<const glm::vec3> points_m,
                      std::span<float> samples) {
  TrilinearSampler(grid).sample(points_m, samples);
}

TrilinearSampler::TrilinearSampler(const BrickView<const float>& grid)
    : grid_(grid),
      finder_(*grid.topology),
      zeros_(2 * static_cast<std::size_t>(grid.n_channels), 0.0f) {
  validate(grid);
  with_channels(grid.n_channels, [&]<int kChannels>() { sample_ = &::sarnerf::sample<kChannels>; });
}

void TrilinearSampler::sample(std::span<const glm::vec3> points_m, std::span<float> samples) {
  expect_field_length(samples.size(), points_m.size() * static_cast<std::size_t>(grid_.n_channels),
                      "the array of interpolated channels");
  sample_(grid_, finder_, points_m, zeros_.data(), samples.data());
}

void scatter_trilinear(const BrickView<float>& grid_gradients, std::span<const glm::vec3> points_m,
                       std::span<const float> sample_gradients) {
  check_samples<float>(grid_gradients, points_m.size(), sample_gradients.size());
  with_channels(grid_gradients.n_channels, [&]<int kChannels>() {
    scatter<kChannels>(grid_gradients, points_m, sample_gradients.data());
  });
}

void sample_gradients(const BrickView<const float>& grid, std::span<const glm::vec3> points_m, std::span<glm::vec3> gradients) {
  validate(grid);
  if (grid.n_channels != 1) throw UsageError("gradients are those of a grid with one channel");
  expect_field_length(gradients.size(), points_m.size(), "the array of gradients");
  const std::array<float, 2> zeros{};
  const auto per_m = static_cast<float>(1.0 / grid.transform.voxel_size_m);
  BrickFinder finder(*grid.topology);
  glm::vec3* out = gradients.data();
  for_each_place(grid, finder, points_m, zeros.data(), [&](const Place<const float>& place, const glm::vec3& f) {
    const std::array<const float*, 8> corner = corners(place);
    glm::vec3 sum(0.0f);
    for (std::size_t n = 0; n < 8; ++n)
      if (corner[n]) sum += *corner[n] * weight_slope(f, n);
    *out++ = per_m * sum;
  });
}

void scatter_gradients(const BrickView<float>& grid_gradients, std::span<const glm::vec3> points_m,
                       std::span<const glm::vec3> by_gradients) {
  validate(grid_gradients);
  if (grid_gradients.n_channels != 1) throw UsageError("gradients are those of a grid with one channel");
  expect_field_length(by_gradients.size(), points_m.size(), "the array of derivatives by gradients");
  std::array<float, 2> nowhere{};
  const auto per_m = static_cast<float>(1.0 / grid_gradients.transform.voxel_size_m);
  BrickFinder finder(*grid_gradients.topology);
  const glm::vec3* in = by_gradients.data();
  for_each_place(grid_gradients, finder, points_m, nowhere.data(), [&](const Place<float>& place, const glm::vec3& f) {
    const std::array<float*, 8> corner = corners(place);
    const glm::vec3 by_gradient = per_m * *in++;
    for (std::size_t n = 0; n < 8; ++n)
      if (corner[n]) *corner[n] += glm::dot(by_gradient, weight_slope(f, n));
  });
}

}  // namespace sarnerf
