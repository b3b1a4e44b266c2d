// SPDX-License-Identifier: Apache-2.0
#include "smoothness.h"

#include "sarnerf/core/parallel.h"

namespace sarnerf {
namespace {

constexpr std::size_t kGrain = 1 << 12;  ///< voxels that a thread takes at a time

}  // namespace

Neighbourhood::Neighbourhood(const GridField& field) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> place(field.n_voxels(), kNone);
  const auto active = field.active_voxels();
  for (std::uint32_t n = 0; n < active.size(); ++n) place[active[n]] = n;
  around_.resize(active.size());
  for (std::uint32_t n = 0; n < active.size(); ++n) around_[n].fill(n);
  const BrickTopology& topology = field.topology();
  for (std::uint32_t n = 0; n < active.size(); ++n) {
    const std::uint32_t brick = active[n] / kBrickVoxels;
    const glm::ivec3 in_brick = voxel_in_brick(active[n]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      glm::ivec3 next = in_brick;
      const auto along = static_cast<int>(axis);
      ++next[along];
      std::uint32_t other = brick;
      if (next[along] == kBrickSide) {
        next[along] = 0;
        other = topology.neighbours(brick)[std::size_t{1} << (2 - axis)];
      }
      if (other == kNoBrick) continue;
      const std::uint32_t m = place[std::size_t{other} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(next))];
      if (m == kNone) continue;
      around_[n][2 * axis] = m;
      around_[m][2 * axis + 1] = n;
    }
  }
}

void Neighbourhood::add_smoothness_gradient(const float* parameters, std::span<const float> weight,
                                            std::span<const float> share, float* gradient) const {
  const std::size_t n_weights = weight.size();
  parallel_for(around_.size(), kGrain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      if (share[n] == 0.0f) continue;
      for (std::size_t c = 0; c < n_weights; ++c) {
        const float own = parameters[n * n_weights + c];
        float differences = 0.0f;
        for (const std::uint32_t other : around_[n]) differences += own - parameters[other * n_weights + c];
        gradient[n * n_weights + c] += weight[c] * differences;
      }
    }
  });
}

}  // namespace sarnerf
