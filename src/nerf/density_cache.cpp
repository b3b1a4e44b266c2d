// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/density_cache.h"

#include <algorithm>
#include <string>

#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

glm::ivec3 voxel_at(const BrickTopology& topology, std::uint32_t place) {
  return topology.coordinate(place / kBrickVoxels) * kBrickSide + voxel_in_brick(place);
}

}  // namespace

DensityCache::DensityCache(const GridTransform& transform, CarvedVoxels voxels)
    : transform_(transform),
      topology_(std::move(voxels.topology)),
      values_(2 * voxels.active.size(), 0.0f) {
  for (std::size_t v = 0; v < voxels.active.size(); ++v)
    if (voxels.active[v] != 0) places_.push_back(static_cast<std::uint32_t>(v));
  refresh(std::vector<float>(places_.size(), 0.0f), -1.0);
}

std::vector<glm::vec3> DensityCache::points_m() const {
  std::vector<glm::vec3> points;
  points.reserve(places_.size());
  for (const std::uint32_t place : places_)
    points.emplace_back(transform_.world_from_index(glm::dvec3(voxel_at(topology_, place))));
  return points;
}

std::vector<float> DensityCache::extinction_per_m() const {
  std::vector<float> extinction;
  extinction.reserve(places_.size());
  for (const std::uint32_t place : places_) extinction.push_back(values_[2 * std::size_t{place}]);
  return extinction;
}

std::vector<std::uint8_t> DensityCache::dilated(std::span<const std::uint8_t> marked) const {
  // Axis by axis: a cube of 3³ is the sum of three lines.
  std::vector<std::uint8_t> before(marked.begin(), marked.end()), after = before;
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 step(0);
    step[axis] = 1;
    for (std::uint32_t place = 0; place < before.size(); ++place) {
      if (before[place] == 0) continue;
      const glm::ivec3 voxel = voxel_at(topology_, place);
      for (const glm::ivec3& next : {voxel - step, voxel + step}) {
        const glm::ivec3 brick = brick_of_voxel(next);
        const std::uint32_t number =
            brick == brick_of_voxel(voxel) ? place / kBrickVoxels : topology_.find(brick);
        if (number != kNoBrick)
          after[std::size_t{number} * kBrickVoxels +
                static_cast<std::size_t>(offset_in_brick(next))] = 1;
      }
    }
    before = after;
  }
  return after;
}

void DensityCache::refresh(std::span<const float> extinction_per_m, double least_depth) {
  if (extinction_per_m.size() != places_.size())
    throw UsageError("density cache: expected " + std::to_string(places_.size()) +
                     " extinctions, found " + std::to_string(extinction_per_m.size()));
  least_depth_ = least_depth;
  const auto least_per_m = static_cast<float>(least_depth / (2.0 * transform_.voxel_size_m));
  std::vector<std::uint8_t> dense(values_.size() / 2, 0);
  for (std::size_t n = 0; n < places_.size(); ++n) {
    values_[2 * std::size_t{places_[n]}] = extinction_per_m[n];
    dense[places_[n]] = extinction_per_m[n] > least_per_m ? 1 : 0;
  }
  const std::vector<std::uint8_t> near = dilated(dense);
  std::vector<float> occupied(near.size(), 0.0f);
  n_occupied_ = 0;
  for (const std::uint32_t place : places_) {
    if (near[place] == 0) continue;
    occupied[place] = 1.0f;
    ++n_occupied_;
  }
  occupancy_ =
      std::make_unique<Occupancy>(BrickView<const float>{&topology_, transform_, 1, occupied}, 1);
}

}  // namespace sarnerf
