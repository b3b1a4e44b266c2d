// SPDX-License-Identifier: Apache-2.0
#include "vdb/vdb_grids.h"

#include <utility>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "sarnerf/scene/vdb_scene.h"
#include "vdb/vdb_layouts.h"

// The program's only instantiations; see vdb_grids.h.
template class openvdb::Grid<openvdb::FloatTree>;
template class openvdb::Grid<openvdb::Vec3STree>;
template class openvdb::Grid<openvdb::Int32Tree>;
template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;

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

VdbSummary VdbScene::summary() const {
  VdbSummary summary;
  summary.voxel_size_m = voxel_size_m();
  for (const openvdb::GridBase::Ptr& grid : grids_->all()) {
    VdbGridSummary line{grid->getName(), grid->valueType(), grid->activeVoxelCount(), grid->memUsage(), {}};
    const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
    if (line.n_active_voxels > 0) {
      for (const openvdb::Coord& corner : {box.min(), box.max().offsetBy(1)}) {
        const openvdb::Vec3d face = corner.asVec3d() - openvdb::Vec3d(0.5);
        const openvdb::Vec3d p = grid->indexToWorld(face);
        line.box_m.include({p.x(), p.y(), p.z()});
      }
    }
    summary.grids.push_back(std::move(line));
  }
  const openvdb::MetaMap& metadata = grids_->metadata;
  for (auto entry = metadata.beginMeta(); entry != metadata.endMeta(); ++entry) {
    if (entry->second) summary.metadata.emplace_back(entry->first, entry->second->str());
  }
  return summary;
}

void VdbScene::set_metadata(const std::string& name, const std::string& value) {
  grids_->metadata.removeMeta(name);
  grids_->metadata.insertMeta(name, openvdb::StringMetadata(value));
}

void VdbScene::set_metadata(const std::string& name, double value) {
  grids_->metadata.removeMeta(name);
  grids_->metadata.insertMeta(name, openvdb::DoubleMetadata(value));
}

void require_complete(const VdbScene::Grids& grids) {
  const auto refuse = [](const std::string& found) {
    throw UsageError("the grids of a volume do not fit together: " + found);
  };
  if (!grids.extinction && !grids.scattering) refuse("neither extinction nor scattering");
  if (grids.extinction_back && !grids.extinction) refuse("extinction_back without extinction");
  const bool scatters = grids.basis == SourceBasis::scattering;
  const bool cosine = grids.basis == SourceBasis::cosine;
  if (grids.harmonics_degree < 0 || grids.harmonics_degree > kMaxHarmonicsDegree) {
    refuse("harmonics of degree " + std::to_string(grids.harmonics_degree));
  }
  const int n_brightness = scatters ? 0 : cosine ? 1 : n_harmonics(grids.harmonics_degree);
  if (static_cast<int>(grids.brightness.size()) != n_brightness) {
    refuse(std::to_string(grids.brightness.size()) + " grids of brightness instead of " +
           std::to_string(n_brightness));
  }
  for (const auto& coefficient : grids.brightness) {
    if (!coefficient) refuse("a brightness without its grid");
  }
  if (scatters != (grids.scattering != nullptr)) refuse("scattering and its basis");
  if (cosine != (grids.normal != nullptr) || cosine != (grids.exponent != nullptr)) {
    refuse("normal and exponent belong to the basis cosine");
  }
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
  add(distance);
  add(unseen);
  add(occupancy);
  return present;
}

openvdb::math::Transform::Ptr vdb_transform(const GridTransform& transform) {
  try {
    auto result = openvdb::math::Transform::createLinearTransform(transform.voxel_size_m);
    result->postTranslate({transform.origin_m.x, transform.origin_m.y, transform.origin_m.z});
    return result;
  } catch (const openvdb::Exception&) {
    throw UsageError("expected voxels of at least 2e-05 m, the smallest that OpenVDB accepts, found " +
                     number_text(transform.voxel_size_m) + " m; make them larger, or check the scene's units");
  }
}

GridTransform grid_transform(const openvdb::math::Transform& transform, const std::string& where) {
  const VdbPlacement placement = placement_of(transform, UpAxis::y, 1.0, where);
  if (placement.moves_voxels()) {
    throw InputError(where + ": expected a transform of uniform scale and translation, found swapped or "
                             "mirrored axes");
  }
  return placement.transform;
}

}  // namespace sarnerf
