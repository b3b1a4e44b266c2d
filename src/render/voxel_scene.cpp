// SPDX-License-Identifier: Apache-2.0
#include "voxel_scene.h"

#include "volume_boxes.h"

namespace sarnerf {
namespace {

int n_extinctions(const FieldChannels& channels) { return channels.first_source(); }

/// Of the longest distance in the scene frame: what rounding to single precision moves a traced ray or a box
/// by, several times over.
constexpr double kSinglePrecision = 0x1p-22;

/// Channel beside the extinctions that scatters by itself, or −1.
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

}  // namespace sarnerf
