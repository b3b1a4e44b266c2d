// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <openvdb/tree/LeafManager.h>

#include "sarnerf/core/parallel.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

namespace {

/// A new grid with the same active voxels and tiles, all set to `value`.
template <class Grid>
typename Grid::Ptr same_voxels(const openvdb::FloatGrid& grid, const char* name,
                               const typename Grid::ValueType& value) {
  using Tree = typename Grid::TreeType;
  auto tree = std::make_shared<Tree>(grid.constTree(), openvdb::zeroVal<typename Grid::ValueType>(), value,
                                     openvdb::TopologyCopy());
  auto result = Grid::create(tree);
  result->setName(name);
  result->setTransform(grid.transform().copy());
  return result;
}

/// Gradient of the signed distance, per voxel along x, y and z; one-sided at the edge of the narrow band, beyond
/// which distances are unknown. In double, because differences and squares of any finite floats are finite there.
glm::dvec3 gradient(openvdb::FloatGrid::ConstUnsafeAccessor& distance, const openvdb::Coord& at, float here) {
  glm::dvec3 slope(0.0);
  for (int n = 0; n < 3; ++n) {
    openvdb::Coord before = at, behind = at;
    before[n] -= 1;
    behind[n] += 1;
    float low = here, high = here;
    const bool has_low = distance.probeValue(before, low), has_high = distance.probeValue(behind, high);
    if (has_low && has_high) slope[n] = 0.5 * (double{high} - double{low});
    if (has_low != has_high) slope[n] = has_high ? double{high} - double{here} : double{here} - double{low};
  }
  return slope;
}

}  // namespace

std::unique_ptr<VdbScene::Grids> solid_grids(const openvdb::FloatGrid& distance, double units_per_voxel) {
  auto grids = std::make_unique<VdbScene::Grids>();
  grids->basis = SourceBasis::cosine;
  grids->extinction = same_voxels<openvdb::FloatGrid>(distance, "extinction", 0.0f);
  grids->extinction->setGridClass(openvdb::GRID_FOG_VOLUME);
  grids->brightness.push_back(same_voxels<openvdb::FloatGrid>(distance, "brightness", 1.0f));
  grids->exponent = same_voxels<openvdb::FloatGrid>(distance, "exponent", 1.0f);
  grids->normal = same_voxels<openvdb::Vec3SGrid>(distance, "normal", openvdb::Vec3s(0, 1, 0));

  const double voxel_m = distance.voxelSize().x();
  const openvdb::tree::LeafManager<openvdb::FloatTree> leaves(grids->extinction->tree());
  parallel_for(leaves.leafCount(), 16, [&](std::size_t begin, std::size_t end, int) {
    openvdb::FloatGrid::ConstUnsafeAccessor known = distance.getConstUnsafeAccessor();
    for (std::size_t l = begin; l < end; ++l) {
      auto& extinction = leaves.leaf(l);
      auto* normals = grids->normal->tree().probeLeaf(extinction.origin());
      for (auto voxel = extinction.beginValueOn(); voxel; ++voxel) {
        const openvdb::Coord at = voxel.getCoord();
        const float here = known.getValue(at);
        // The clamp is far beyond any depth that matters and keeps the value within a float.
        const auto depth = static_cast<float>(std::clamp(-double{here} / units_per_voxel, -1e6, 1e6));
        voxel.setValue(static_cast<float>(0.5 * opaque_extinction_per_voxel(depth) / voxel_m));
        const glm::dvec3 slope = gradient(known, at, here);
        const double steepness = glm::length(slope);
        if (!(steepness > 0.0)) continue;
        const glm::vec3 normal(slope / steepness);
        normals->setValueOnly(voxel.pos(), openvdb::Vec3s(normal.x, normal.y, normal.z));
      }
    }
  });
  return grids;
}

}  // namespace sarnerf
