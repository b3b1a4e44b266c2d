// SPDX-License-Identifier: Apache-2.0
#include <openvdb/io/File.h>

#include <string>

#include "sarnerf/core/error.h"
#include "vdb_grids.h"

namespace sarnerf {
namespace {

template <class Grid>
typename Grid::Ptr find_grid(const openvdb::GridPtrVec& grids, const std::string& name,
                             const std::string& where) {
  for (const openvdb::GridBase::Ptr& grid : grids) {
    if (grid->getName() != name) continue;
    if (auto typed = openvdb::gridPtrCast<Grid>(grid)) return typed;
    throw InputError(where + ": grid \"" + name + "\": expected type " + Grid::gridType() + ", found " +
                     grid->type());
  }
  return nullptr;
}

}  // namespace

VdbScene read_vdb(const std::filesystem::path& path, const VdbReadOptions& options) {
  openvdb::initialize();
  const std::string where = path.string();
  openvdb::GridPtrVecPtr read;
  openvdb::MetaMap::Ptr metadata;
  try {
    openvdb::io::File file(where);
    file.open(false);
    read = file.getGrids();
    metadata = file.getMetadata();
  } catch (const openvdb::Exception& failure) {
    throw InputError(where + ": cannot be read as an OpenVDB file (" + failure.what() + ")");
  }
  options.monitor.check();
  auto grids = std::make_unique<VdbScene::Grids>();
  grids->extinction = find_grid<openvdb::FloatGrid>(*read, "extinction", where);
  grids->extinction_back = find_grid<openvdb::FloatGrid>(*read, "extinction_back", where);
  grids->scattering = find_grid<openvdb::FloatGrid>(*read, "scattering", where);
  grids->component = find_grid<openvdb::Int32Grid>(*read, "component", where);
  grids->basis = SourceBasis::scattering;
  if (const auto basis = metadata->getMetadata<openvdb::StringMetadata>("brightness_basis")) {
    grids->basis = basis->value() == "cosine" ? SourceBasis::cosine : SourceBasis::harmonics;
    for (int n = 0; n < kMaxHarmonics; ++n) {
      const std::string name = n == 0 ? "brightness" : "brightness_" + std::to_string(n);
      auto grid = find_grid<openvdb::FloatGrid>(*read, name, where);
      if (!grid) break;
      grids->brightness.push_back(grid);
    }
    grids->harmonics_degree = grids->brightness.size() >= 9 ? 2 : grids->brightness.size() >= 4 ? 1 : 0;
    grids->normal = find_grid<openvdb::Vec3SGrid>(*read, "normal", where);
    grids->exponent = find_grid<openvdb::FloatGrid>(*read, "exponent", where);
  }
  if (!grids->extinction && !grids->scattering) {
    throw InputError(where + ": expected a grid named \"extinction\" or \"scattering\"");
  }
  VdbScene scene(std::move(grids));
  const auto least = metadata->getMetadata<openvdb::Vec3DMetadata>("scene_box_min_m");
  const auto most = metadata->getMetadata<openvdb::Vec3DMetadata>("scene_box_max_m");
  if (least && most) {
    scene.scene_box_m.min = {least->value().x(), least->value().y(), least->value().z()};
    scene.scene_box_m.max = {most->value().x(), most->value().y(), most->value().z()};
  }
  return scene;
}

}  // namespace sarnerf
