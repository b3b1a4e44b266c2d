// SPDX-License-Identifier: Apache-2.0
#include "volume_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sarnerf {

VolumeSurface::VolumeSurface(const Volume& volume, const BrickView<const float>& grid)
    : volume_(volume),
      transform_(grid.transform),
      finder_(*grid.topology),
      sampler_(grid),
      channels_(static_cast<std::size_t>(grid.n_channels)) {}

Component VolumeSurface::component(const glm::vec3& point_m) {
  if (volume_.component.empty()) return Component::other;
  const glm::dvec3 index = transform_.index_from_world(glm::dvec3(point_m));
  const glm::dvec3 low = glm::floor(index), part = index - low;
  std::array<double, 5> weight{};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 step(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
    const glm::ivec3 voxel = glm::ivec3(low) + step;
    const std::uint32_t brick = finder_.find(brick_of_voxel(voxel));
    if (brick == kNoBrick) continue;
    const Component c = volume_.component[std::size_t{brick} * kBrickVoxels +
                                          static_cast<std::size_t>(offset_in_brick(voxel))];
    const glm::dvec3 share = glm::mix(1.0 - part, part, glm::dvec3(step));
    weight[static_cast<std::size_t>(c)] += share.x * share.y * share.z;
  }
  const auto most = std::max_element(weight.begin() + 1, weight.end());
  return *most > 0.0 ? static_cast<Component>(most - weight.begin()) : Component::other;
}

double VolumeSurface::incidence_rad(const glm::vec3& point_m, const glm::vec3& direction) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (volume_.channels.basis != SourceBasis::cosine) return kNone;
  sampler_.sample({&point_m, 1}, channels_);
  const float* const source = channels_.data() + volume_.channels.first_source();
  const glm::dvec3 normal(source[1], source[2], source[3]);
  const double length = glm::length(normal);
  if (!(length > 0.0)) return kNone;
  return std::acos(std::min(1.0, std::abs(glm::dot(normal, glm::dvec3(direction))) / length));
}

}  // namespace sarnerf
