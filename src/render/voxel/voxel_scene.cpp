// SPDX-License-Identifier: Apache-2.0
#include "voxel/voxel_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "sarnerf/field/brick_grid.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

namespace {

/// The occupied part of each of a volume's bricks of cells, as a box in world coordinates.
std::vector<Box> volume_boxes_m(const Occupancy& occupancy, const GridTransform& transform) {
  std::vector<Box> boxes;
  boxes.reserve(occupancy.bricks().n_bricks());
  for (std::uint32_t brick = 0; brick < occupancy.bricks().n_bricks(); ++brick) {
    const Occupancy::CellBox cells = occupancy.cell_box(brick);
    const glm::ivec3 origin = occupancy.bricks().coordinate(brick) * kBrickSide;
    Box box;
    box.include(transform.world_from_index(glm::dvec3(origin + cells.first)));
    box.include(transform.world_from_index(glm::dvec3(origin + cells.last + 1)));
    boxes.push_back(box);
  }
  return boxes;
}

int n_extinctions(const FieldChannels& channels) { return channels.first_source(); }

/// Fraction of the longest distance in the scene frame, several times the displacement of a traced ray or a box by
/// rounding to single precision.
constexpr double kSinglePrecision = 0x1p-22;

/// Channel of the scattering P if the volume has one, or −1.
int scattering_channel(const FieldChannels& channels) {
  return channels.basis == SourceBasis::scattering ? channels.first_source() : -1;
}

}  // namespace

VoxelScene::VoxelScene(const Scene& s, Volume v)
    : scene(s),
      volume(std::move(v)),
      occupancy(volume.grid.view(), n_extinctions(volume.channels), scattering_channel(volume.channels)),
      boxes_m(volume_boxes_m(occupancy, volume.grid.transform())),
      origin_m(volume.support_m.empty() ? glm::dvec3(0.0) : volume.support_m.centre()),
      slack_m(volume.support_m.empty() ? 0.0 : kSinglePrecision * glm::length(volume.support_m.size())) {
  std::vector<BoxTracer::FloatBox> boxes;
  for (const Box& box : boxes_m) {
    boxes.push_back({glm::vec3(box.min - origin_m - slack_m), glm::vec3(box.max - origin_m + slack_m)});
  }
  if (!boxes.empty()) tracer.emplace(boxes);
  if (s.ground) ground = ground_appearance(s, origin_m);
}

Scene VoxelScene::planned() const {
  Scene view;
  view.box = volume.support_m;
  view.ground = scene.ground;
  view.materials = scene.materials;
  return view;
}

std::vector<Box> VoxelScene::boxes_from(const glm::dvec3& aim_m) const {
  std::vector<Box> boxes = boxes_m;
  for (Box& box : boxes) box = {box.min - aim_m, box.max - aim_m};
  return boxes;
}

std::uint64_t VoxelScene::memory_bytes() const {
  return volume.memory_bytes() + occupancy.memory_bytes() + boxes_m.size() * sizeof(Box) +
         (tracer ? tracer->memory_bytes() : 0);
}

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
