// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/carving.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

/// Range offset from which on a row, or one of its neighbours, returns power.
struct FirstReturns {
  Acquisition acquisition;
  RadarFrame frame;
  std::vector<double> range_offset_m;  ///< [n_azimuth]
};

FirstReturns first_returns(const PosedImage& image, double zero_level) {
  const Acquisition& a = image.acquisition;
  const int n_rows = a.n_azimuth;
  std::vector<double> own(static_cast<std::size_t>(n_rows));
  for (int i = 0; i < n_rows; ++i) {
    int j = 0;
    while (j < a.n_range && double{image.power(i, j)} <= zero_level) ++j;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    // A row without any return is empty throughout.
    own[static_cast<std::size_t>(i)] = j == 0           ? -kInfinity
                                       : j == a.n_range ? kInfinity
                                                        : a.bin_offset_m(j - 0.5);
  }
  FirstReturns first{a, radar_frame(a), own};
  for (int i = 0; i < n_rows; ++i)
    for (int n = std::max(0, i - 1); n <= std::min(n_rows - 1, i + 1); ++n)
      first.range_offset_m[static_cast<std::size_t>(i)] =
          std::min(first.range_offset_m[static_cast<std::size_t>(i)], own[static_cast<std::size_t>(n)]);
  return first;
}

enum class Evidence { none, maybe, empty };

/// What one view says about a place: nothing where it lies outside of the swath.
Evidence evidence(const FirstReturns& view, const glm::dvec3& point_m, double margin_m) {
  const RadarPoint p = project(view.acquisition, view.frame, point_m);
  const Acquisition& a = view.acquisition;
  const auto i = static_cast<int>(std::lround(p.along_track_m / a.azimuth_spacing_m + 0.5 * (a.n_azimuth - 1)));
  if (i < 0 || i >= a.n_azimuth) return Evidence::none;
  if (p.range_offset_m < a.bin_offset_m(-0.5) || p.range_offset_m > a.bin_offset_m(a.n_range - 0.5))
    return Evidence::none;
  return p.range_offset_m + margin_m < view.range_offset_m[static_cast<std::size_t>(i)] ? Evidence::empty
                                                                                        : Evidence::maybe;
}

/// Whether some view sees the place and none sees it empty.
bool may_hold_matter(std::span<const FirstReturns> views, const glm::dvec3& point_m, double margin_m) {
  bool seen = false;
  for (const FirstReturns& view : views) {
    const Evidence e = evidence(view, point_m, margin_m);
    if (e == Evidence::empty) return false;
    seen |= e == Evidence::maybe;
  }
  return seen;
}

}  // namespace

GridTransform grid_transform(const TrainingSet& set, double voxel_size_m) {
  const glm::dvec3 size = set.box_m.size();
  const glm::dvec3 n = glm::ceil(size / voxel_size_m);
  GridTransform transform;
  transform.voxel_size_m = voxel_size_m;
  transform.origin_m = set.box_m.centre() - 0.5 * voxel_size_m * n;
  // The reference plane lies between a voxel and the next: what stands on it begins half a voxel above.
  transform.origin_m.y = set.box_m.min.y - 0.5 * voxel_size_m;
  return transform;
}

CarvedVoxels carve(const TrainingSet& set, const GridTransform& transform, double zero_level) {
  std::vector<FirstReturns> views;
  for (const PosedImage& image : set.images) views.push_back(first_returns(image, zero_level));
  const double margin_m = transform.voxel_size_m;
  const glm::ivec3 last = glm::ivec3(glm::ceil(transform.index_from_world(set.box_m.max)));
  const glm::ivec3 first = glm::ivec3(glm::floor(transform.index_from_world(set.box_m.min))) - glm::ivec3(0, 1, 0);
  const glm::ivec3 first_brick = brick_of_voxel(first), n = brick_of_voxel(last) - first_brick + 1;
  const auto n_bricks = static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z);
  std::vector<std::vector<std::uint8_t>> kept(n_bricks);
  const auto brick_at = [&](std::size_t b) {
    const auto s = static_cast<int>(b);
    return first_brick + glm::ivec3(s / (n.y * n.z), s / n.z % n.y, s % n.z);
  };
  parallel_for(n_bricks, 16, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t b = begin; b < end; ++b) {
      std::vector<std::uint8_t> active(kBrickVoxels, 0);
      bool any = false;
      const glm::ivec3 origin = brick_at(b) * kBrickSide;
      for (int v = 0; v < kBrickVoxels; ++v) {
        const glm::ivec3 voxel = origin + glm::ivec3(v >> 6, v >> 3 & 7, v & 7);
        if (glm::any(glm::lessThan(voxel, first)) || glm::any(glm::greaterThan(voxel, last))) continue;
        const glm::dvec3 point_m = transform.world_from_index(glm::dvec3(voxel));
        const bool keep = may_hold_matter(views, point_m, margin_m);
        active[static_cast<std::size_t>(v)] = keep ? 1 : 0;
        any |= keep;
      }
      if (any) kept[b] = std::move(active);
    }
  });
  CarvedVoxels carved;
  for (std::size_t b = 0; b < n_bricks; ++b) {
    if (kept[b].empty()) continue;
    carved.topology.insert(brick_at(b));
    carved.active.insert(carved.active.end(), kept[b].begin(), kept[b].end());
  }
  return carved;
}

}  // namespace sarnerf
