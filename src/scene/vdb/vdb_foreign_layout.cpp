// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "vdb/vdb_grids.h"
#include "vdb/vdb_layouts.h"

namespace sarnerf {

namespace {

/// Least half width (voxels) of a narrow band: the outermost corner of an absorbing cell lies 1.6 voxels outside
/// the surface, and a shell of this depth has an optical depth of 20 or more.
constexpr double kLeastBand = 2.0;

bool is_fog(const VdbFileGrid& grid) {
  return grid.grid_class() == "fog volume" || (grid.name == "density" && grid.grid_class() != "level set");
}
bool is_level_set(const VdbFileGrid& grid) {
  return grid.grid_class() == "level set" || (grid.name == "surface" && grid.grid_class() != "fog volume");
}

/// The only grid of a kind, or the one with the usual name if there are several. Grids of types other than float
/// are chosen only if there is no float grid, so that the error message names their type.
const VdbFileGrid* choose(const VdbFile& file, bool (*of_kind)(const VdbFileGrid&), const std::string& usual) {
  std::vector<const VdbFileGrid*> found, floats;
  for (const VdbFileGrid& grid : file.grids) {
    if (!of_kind(grid)) continue;
    found.push_back(&grid);
    if (grid.type == openvdb::FloatTree::treeType()) floats.push_back(&grid);
  }
  if (!floats.empty()) found = floats;
  if (found.size() <= 1) return found.empty() ? nullptr : found.front();
  const auto named = std::find_if(found.begin(), found.end(),
                                  [&](const VdbFileGrid* grid) { return grid->name == usual; });
  if (named != found.end()) return *named;
  throw InputError(file.name + ": expected one volume, or one called \"" + usual + "\", found " +
                   listed_grids(file) + "; rename the one to use");
}

std::unique_ptr<VdbScene::Grids> fog_grids(openvdb::FloatGrid::Ptr density, const VdbReading& reading) {
  const VdbReadOptions& options = reading.options;
  auto grids = std::make_unique<VdbScene::Grids>();
  grids->basis = SourceBasis::scattering;
  multiply_values(*density, options.extinction_per_density);
  grids->scattering = density->deepCopy();
  multiply_values(*grids->scattering, options.albedo);
  grids->extinction = std::move(density);
  grids->extinction->setName("extinction");
  grids->scattering->setName("scattering");
  for (const auto& grid : {grids->extinction, grids->scattering}) {
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  }
  return grids;
}

/// Throws InputError unless the distances form a level set in a wide enough band; the voxel size has their units.
void require_level_set(const openvdb::FloatGrid& distance, double units_per_voxel, const std::string& where) {
  const double band = double{distance.background()} / units_per_voxel;
  if (!(band >= kLeastBand) || !std::isfinite(band)) {
    throw InputError(where + ": expected a level set whose band reaches " + number_text(kLeastBand) +
                     " voxels to both sides, found a background of " + number_text(band) +
                     " voxels; rebuild it with a half width of 3");
  }
  // A tile has one distance for many voxels: no surface lies there, and no normal can be computed.
  auto tile = distance.constTree().cbeginValueOn();
  tile.setMaxDepth(openvdb::FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
  if (tile) {
    throw InputError(where + ": expected a level set in a narrow band, found active tiles; rebuild it as one");
  }
}

}  // namespace

std::unique_ptr<VdbScene::Grids> read_foreign_layout(VdbReading& reading) {
  const VdbFile& file = reading.file();
  const VdbReadOptions& options = reading.options;
  const VdbFileGrid* chosen = choose(file, is_fog, "density");
  const bool fog = chosen != nullptr;
  if (!fog) chosen = choose(file, is_level_set, "surface");
  if (!chosen) {
    throw InputError(file.name + ": expected grids \"extinction\" and \"scattering\" or \"brightness\", a fog "
                                 "volume, or a level set; found " + listed_grids(file));
  }
  reading.is_fog = fog;
  const std::string where = reading.place(*chosen);
  openvdb::FloatGrid::Ptr grid = reading.loader.load<openvdb::FloatGrid>(*chosen);
  const double metres_per_unit = options.units_m * options.scale;
  const VdbPlacement placement = placement_of(grid->transform(), options.up, metres_per_unit, where);
  const double units_per_voxel = placement.transform.voxel_size_m / metres_per_unit;
  if (fog) {
    require_values(*grid, ValueRule::not_negative,
                   options.extinction_per_density * std::max(1.0, options.albedo), where);
  } else {
    require_finite_distances(*grid, where);
    require_level_set(*grid, units_per_voxel, where);
  }
  // Fog adds a grid of scattering; a level set adds brightness, exponent, extinction, and a normal of three numbers.
  reading.loader.require_memory(*chosen, grid->memUsage() * (fog ? 1u : 6u));
  place_grid(grid, placement, where);

  if (fog) {
    reading.notes.push_back(where + ": taken for fog: one-way extinction = density × " +
                            number_text(options.extinction_per_density) + " per metre, scattering = extinction × " +
                            number_text(options.albedo) + ", the same in all directions");
  } else {
    reading.notes.push_back(where + ": taken for the surface of an opaque solid: gamma0 1, exponent 1, "
                                    "normals from the distances");
  }
  if (file.grids.size() > 1) {
    reading.notes.push_back(file.name + ": other grids are not used; it holds " + listed_grids(file));
  }
  return fog ? fog_grids(std::move(grid), reading) : solid_grids(*grid, units_per_voxel);
}

}  // namespace sarnerf
