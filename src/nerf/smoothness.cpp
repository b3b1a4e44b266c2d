// SPDX-License-Identifier: Apache-2.0
#include "smoothness.h"

namespace sarnerf {

Neighbourhood::Neighbourhood(const GridField& field) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> place(field.n_voxels(), kNone);
  const auto active = field.active_voxels();
  for (std::uint32_t n = 0; n < active.size(); ++n) place[active[n]] = n;
  const BrickTopology& topology = field.topology();
  for (std::uint32_t n = 0; n < active.size(); ++n) {
    const std::uint32_t brick = active[n] / kBrickVoxels;
    const int offset = static_cast<int>(active[n] % kBrickVoxels);
    const glm::ivec3 in_brick(offset >> 6, offset >> 3 & 7, offset & 7);
    for (int axis = 0; axis < 3; ++axis) {
      glm::ivec3 next = in_brick;
      ++next[axis];
      std::uint32_t other = brick;
      if (next[axis] == kBrickSide) {
        next[axis] = 0;
        other = topology.neighbours(brick)[std::size_t{1} << (2 - axis)];
      }
      if (other == kNoBrick) continue;
      const std::uint32_t m = place[std::size_t{other} * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(next))];
      if (m != kNone) pairs_.push_back({n, m});
    }
  }
}

void Neighbourhood::add_smoothness_gradient(const float* parameters, std::span<const float> weight,
                                            float* gradient) const {
  const std::size_t n = weight.size();
  for (const auto& [p, q] : pairs_) {
    for (std::size_t c = 0; c < n; ++c) {
      const std::size_t a = std::size_t{p} * n + c, b = std::size_t{q} * n + c;
      const float d = weight[c] * (parameters[a] - parameters[b]);
      gradient[a] += d;
      gradient[b] -= d;
    }
  }
}

}  // namespace sarnerf
