// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <memory>
#include <string>

#include "learned_volume.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/nerf/model_file.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

namespace {

/// A ray of a map, and an allowance for its ReturnMap::Return: 56 bytes, of the rays with power only, about a third.
constexpr double kBytesPerRay = 12.0 + 16.0;

double rays_of(const Acquisition& view, const Box& box_m, double spacing_m) {
  const RadarFrame frame = radar_frame(view);
  double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
  for (const glm::dvec3& corner : box_m.corners()) {
    low_m = std::min(low_m, glm::dot(corner, frame.h));
    high_m = std::max(high_m, glm::dot(corner, frame.h));
  }
  const auto [lowest_rad, highest_rad] = angular_extent(view, box_m);
  const double n_along = (high_m - low_m) / spacing_m + 4.0;
  const double n_angles = (highest_rad - lowest_rad) * view.slant_range_m / spacing_m + 3.0;
  return n_along * n_angles;
}

}  // namespace

std::uint64_t return_map_bytes(std::span<const Acquisition> views, const Box& box_m, double spacing_m) {
  double n_rays = 0.0;
  for (const Acquisition& view : views) n_rays += rays_of(view, box_m, spacing_m);
  return static_cast<std::uint64_t>(kBytesPerRay * n_rays);
}

std::uint64_t memory_beside_maps(std::span<const Acquisition> views, const Box& box_m, double spacing_m,
                                 std::uint64_t max_memory_bytes) {
  if (max_memory_bytes == 0) return 0;
  const std::uint64_t needed = return_map_bytes(views, box_m, spacing_m);
  if (needed < max_memory_bytes) return max_memory_bytes - needed;
  throw UsageError(format("about %.3g MiB are needed for the return maps of %zu views, more than --max-memory allows (%.3g MiB left); "
                          "--shell needs none of it",
                          static_cast<double>(needed) / 1048576.0, views.size(),
                          static_cast<double>(max_memory_bytes) / 1048576.0));
}

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
  volume.set_metadata("body", std::string(options.body == Body::solid ? "solid" : "shell"));
  volume.set_metadata("threshold_per_m", extraction.threshold_per_m);
  if (options.body == Body::solid) volume.set_metadata("agreeing_share", extraction.agreeing_share);
  if (model.field->kind() == "mlp") volume.set_metadata("harmonics_residual", extraction.harmonics_residual);
}

}  // namespace sarnerf
