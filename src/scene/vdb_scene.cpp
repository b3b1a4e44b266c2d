// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/scene/vdb_scene.h"

#include <utility>

#include "sarnerf/core/error.h"
#include "vdb_grids.h"

namespace sarnerf {

VdbScene::VdbScene() : grids_(std::make_unique<Grids>()) { openvdb::initialize(); }
VdbScene::VdbScene(std::unique_ptr<Grids> grids) : grids_(std::move(grids)) {}
VdbScene::~VdbScene() = default;
VdbScene::VdbScene(VdbScene&&) noexcept = default;
VdbScene& VdbScene::operator=(VdbScene&&) noexcept = default;

double VdbScene::voxel_size_m() const {
  const auto all = grids_->all();
  return all.empty() ? 0.0 : all.front()->voxelSize().x();
}

std::vector<VdbGridSummary> VdbScene::summary() const {
  std::vector<VdbGridSummary> lines;
  for (const openvdb::GridBase::Ptr& grid : grids_->all()) {
    lines.push_back({grid->getName(), grid->valueType(), grid->activeVoxelCount(), grid->memUsage()});
  }
  return lines;
}

std::vector<openvdb::GridBase::Ptr> VdbScene::Grids::all() const {
  std::vector<openvdb::GridBase::Ptr> present;
  const auto add = [&](const openvdb::GridBase::Ptr& grid) {
    if (grid) present.push_back(grid);
  };
  add(extinction);
  add(extinction_back);
  add(scattering);
  for (const auto& coefficient : brightness) add(coefficient);
  add(normal);
  add(exponent);
  add(component);
  return present;
}

openvdb::math::Transform::Ptr vdb_transform(const GridTransform& transform) {
  auto result = openvdb::math::Transform::createLinearTransform(transform.voxel_size_m);
  result->postTranslate({transform.origin_m.x, transform.origin_m.y, transform.origin_m.z});
  return result;
}

GridTransform grid_transform(const openvdb::math::Transform& transform, const std::string& where) {
  // Linear maps are known by what they do to the origin and the axes.
  const auto image = [&](double x, double y, double z) {
    const openvdb::Vec3d p = transform.indexToWorld(openvdb::Vec3d(x, y, z));
    return glm::dvec3(p.x(), p.y(), p.z());
  };
  if (!transform.isLinear()) {
    throw InputError(where + ": expected a transform of uniform scale and translation, found a "
                             "perspective one; resample the grid");
  }
  const glm::dvec3 origin = image(0, 0, 0);
  const glm::dmat3 axes(image(1, 0, 0) - origin, image(0, 1, 0) - origin, image(0, 0, 1) - origin);
  const double size = axes[0][0];
  const glm::dmat3 off = axes - glm::dmat3(size);
  double largest = 0.0;
  for (int n = 0; n < 3; ++n) {
    for (int m = 0; m < 3; ++m) largest = std::max(largest, std::abs(off[n][m]));
  }
  // A large translation leaves its rounding in the differences.
  const double rounding = 1e-12 * (std::abs(origin.x) + std::abs(origin.y) + std::abs(origin.z));
  if (!(size > 0.0) || !(largest <= 1e-6 * size + rounding)) {
    throw InputError(where + ": expected a transform of uniform scale and translation, found a "
                             "sheared, rotated, mirrored or non-uniform one; resample the grid");
  }
  return {origin, transform.voxelSize().x()};
}

}  // namespace sarnerf
