// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <string>

#include "learned_volume.h"
#include "sarnerf/nerf/model_file.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Channel c as a grid.
openvdb::FloatGrid::Ptr channel(const LearnedVolume& volume, int c, const openvdb::math::Transform::Ptr& transform) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setTransform(transform);
  const BrickView<const float> view = volume.grid.view();
  for (std::uint32_t b = 0; b < view.topology->n_bricks(); ++b) {
    const glm::ivec3 origin = view.topology->coordinate(b) * kBrickSide;
    auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), 0.0f, false);
    for (int v = 0; v < kBrickVoxels; ++v) {
      const float* const value = view.voxel(b, v);
      // Voxels are active in all grids or in none.
      if (std::any_of(value, value + view.n_channels, [](float x) { return x != 0.0f; }))
        leaf->setValueOn(static_cast<openvdb::Index>(v), value[c]);
    }
    if (!leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
  }
  return grid;
}

}  // namespace

std::vector<std::string> grid_names(const FieldChannels& channels) {
  std::vector<std::string> names{"extinction"};
  for (int l = 0; l < channels.n_source(); ++l)
    names.push_back(l == 0 ? "brightness" : "brightness_" + std::to_string(l));
  names.emplace_back("occupancy");
  return names;
}

openvdb::FloatGrid::Ptr occupancy_above(const LearnedVolume& volume, double threshold_per_m, std::optional<double> floor_m) {
  const auto grid = openvdb::FloatGrid::create(0.0f);
  const BrickView<const float> view = volume.grid.view();
  const GridTransform& transform = volume.grid.transform();
  for (std::uint32_t b = 0; b < view.topology->n_bricks(); ++b) {
    const glm::ivec3 origin = view.topology->coordinate(b) * kBrickSide;
    auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), 0.0f, false);
    for (int v = 0; v < kBrickVoxels; ++v) {
      double value = std::min(1.0, 0.5 * double{view.voxel(b, v)[0]} / threshold_per_m);
      if (floor_m) {
        const double above_m = transform.world_from_index(glm::dvec3(origin + voxel_in_brick(v))).y - *floor_m;
        value = std::min(value, std::clamp(0.5 + 0.5 * above_m / transform.voxel_size_m, 0.0, 1.0));
      }
      if (value > 0.0) leaf->setValueOn(static_cast<openvdb::Index>(v), static_cast<float>(value));
    }
    if (!leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
  }
  return grid;
}

VdbScene volume_grids(const LearnedVolume& volume, const GridTransform& in_world,
                      const openvdb::FloatGrid::Ptr& occupancy, bool as_half) {
  VdbScene scene;
  VdbScene::Grids& grids = scene.grids();
  const auto transform = vdb_transform(in_world);
  grids.basis = volume.channels.basis;
  grids.harmonics_degree = volume.channels.harmonics_degree;
  grids.extinction = channel(volume, 0, transform);
  const std::vector<std::string> names = grid_names(volume.channels);
  grids.extinction->setName(names.front());
  for (int l = 0; l < volume.channels.n_source(); ++l) {
    grids.brightness.push_back(channel(volume, volume.channels.first_source() + l, transform));
    grids.brightness.back()->setSaveFloatAsHalf(as_half);
    grids.brightness.back()->setName(names[1 + static_cast<std::size_t>(l)]);
  }
  occupancy->setTransform(transform);
  occupancy->setName(names.back());
  grids.occupancy = occupancy;
  return scene;
}

void describe(VdbScene& volume, const Model& model, const ExtractOptions& options, const Extraction& extraction) {
  const ModelInfo& info = model.info;
  volume.set_metadata("field", std::string(model.field->kind()));
  volume.set_metadata("integrator", std::string(name(model.field->integrator())));
  volume.set_metadata("reference_bin_m", info.reference_bin_m);
  volume.set_metadata("training_program", info.program);
  volume.set_metadata("training_steps", static_cast<double>(info.steps));
  volume.set_metadata("training_views", static_cast<double>(info.training_views.size()));
  volume.set_metadata("dataset", info.dataset);
  volume.set_metadata("dataset_sha256", info.dataset_sha256);
  if (!options.model_sha256.empty()) volume.set_metadata("model_sha256", options.model_sha256);
  // As in render_view().
  if (options.resolution == 0 && model.field->kind() == "grid") volume.set_metadata("longest_segment_voxels", 1.0);
  volume.set_metadata("bottom_m", extraction.bottom_m);
  if (model.field->kind() == "surface") {
    volume.set_metadata("body", std::string("surface"));
    return;
  }
  volume.set_metadata("body", std::string("threshold"));
  volume.set_metadata("threshold_per_m", extraction.threshold_per_m);
  if (is_network(model.field->kind())) volume.set_metadata("harmonics_residual", extraction.harmonics_residual);
}

}  // namespace sarnerf
