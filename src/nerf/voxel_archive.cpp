// SPDX-License-Identifier: Apache-2.0
#include "voxel_archive.h"

#include <algorithm>

#include "sarnerf/core/error.h"

namespace sarnerf {

void add_voxels(Archive& archive, const BrickTopology& topology,
                std::span<const std::uint32_t> active) {
  const auto n_bricks = static_cast<std::int64_t>(topology.n_bricks());
  torch::Tensor bricks = torch::empty({n_bricks, 3}, torch::kInt);
  int* out = bricks.data_ptr<int>();
  for (std::uint32_t b = 0; b < n_bricks; ++b)
    for (int axis = 0; axis < 3; ++axis) *out++ = topology.coordinate(b)[axis];
  torch::Tensor voxels = torch::empty({static_cast<std::int64_t>(active.size())}, torch::kLong);
  std::copy(active.begin(), active.end(), voxels.data_ptr<std::int64_t>());
  archive.tensors["bricks"] = bricks;
  archive.tensors["voxels"] = voxels;
}

CarvedVoxels voxels_of(const Archive& archive, const std::string& where) {
  const auto require = [&](bool holds, const char* what) {
    if (!holds) throw CheckpointError(where + ": " + what + "; the file is damaged");
  };
  const torch::Tensor bricks = archive.tensor("bricks", torch::kInt, 2, where).contiguous();
  const torch::Tensor voxels = archive.tensor("voxels", torch::kLong, 1, where).contiguous();
  require(bricks.size(1) == 3, "a brick does not have three coordinates");
  CarvedVoxels result;
  const int* b = bricks.data_ptr<int>();
  for (std::int64_t n = 0; n < bricks.size(0); ++n, b += 3) {
    const glm::ivec3 brick(b[0], b[1], b[2]);
    require(glm::all(glm::lessThanEqual(glm::abs(brick), glm::ivec3(kMaxBrick))),
            "a brick is out of reach");
    require(result.topology.insert(brick) == n, "a brick is there twice");
  }
  result.active.assign(result.topology.n_bricks() * kBrickVoxels, 0);
  std::int64_t last = -1;
  const auto* v = voxels.data_ptr<std::int64_t>();
  for (std::int64_t n = 0; n < voxels.size(0); ++n) {
    require(v[n] > last && v[n] < static_cast<std::int64_t>(result.active.size()),
            "voxels are not in order");
    result.active[static_cast<std::size_t>(last = v[n])] = 1;
  }
  return result;
}

}  // namespace sarnerf
