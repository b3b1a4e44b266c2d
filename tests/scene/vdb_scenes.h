// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <string>

#include "files.h"
#include "sarnerf/scene/vdb_scene.h"
#include "vdb/vdb_grids.h"

namespace sarnerf::test {

inline std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Voxels of half a metre whose centre (0, 0, 0) lies off the world's origin.
inline const GridTransform kLattice{{3.25, -1.5, 1e6 + 0.125}, 0.5};

template <class Grid>
typename Grid::Ptr grid_at(const GridTransform& transform, const std::string& name) {
  openvdb::initialize();
  auto grid = Grid::create();
  grid->setName(name);
  grid->setTransform(vdb_transform(transform));
  return grid;
}

/// Random numbers in [low, high) at random voxels around the origin, most of them beside others.
inline openvdb::FloatGrid::Ptr random_floats(const std::string& name, unsigned seed, float low, float high,
                                             const GridTransform& transform = kLattice, int n_voxels = 2000) {
  auto grid = grid_at<openvdb::FloatGrid>(transform, name);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> index(-12, 20);
  std::uniform_real_distribution<float> value(low, high);
  auto values = grid->getAccessor();
  for (int n = 0; n < n_voxels; ++n) values.setValue({index(random), index(random), index(random)}, value(random));
  return grid;
}

inline std::unique_ptr<VdbScene::Grids> scattering_grids(unsigned seed = 1) {
  auto grids = std::make_unique<VdbScene::Grids>();
  grids->basis = SourceBasis::scattering;
  grids->extinction = random_floats("extinction", seed, 0.0f, 2.0f);
  grids->scattering = random_floats("scattering", seed, 0.0f, 1.0f);
  return grids;
}

inline std::unique_ptr<VdbScene::Grids> harmonics_grids(int degree, int n_voxels = 2000) {
  auto grids = std::make_unique<VdbScene::Grids>();
  grids->basis = SourceBasis::harmonics;
  grids->harmonics_degree = degree;
  grids->extinction = random_floats("extinction", 5, 0.0f, 2.0f, kLattice, n_voxels);
  for (int n = 0; n < n_harmonics(degree); ++n) {
    const std::string name = n == 0 ? "brightness" : "brightness_" + std::to_string(n);
    grids->brightness.push_back(random_floats(name, 5, n == 0 ? 0.0f : -1.0f, 1.0f, kLattice, n_voxels));
  }
  return grids;
}

inline std::unique_ptr<VdbScene::Grids> cosine_grids(int n_voxels = 2000) {
  auto grids = harmonics_grids(0, n_voxels);
  grids->basis = SourceBasis::cosine;
  grids->exponent = random_floats("exponent", 5, 0.0f, 3.0f, kLattice, n_voxels);
  grids->normal = grid_at<openvdb::Vec3SGrid>(kLattice, "normal");
  grids->component = grid_at<openvdb::Int32Grid>(kLattice, "component");
  for (auto voxel = grids->extinction->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord at = voxel.getCoord();
    const openvdb::Vec3s normal(static_cast<float>(at.x()), static_cast<float>(at.y()), 1.0f);
    grids->normal->tree().setValue(at, normal.unit());
    grids->component->tree().setValue(at, 1 + (at.z() & 3));
  }
  return grids;
}

/// Writes grids with OpenVDB's own writer, as other tools do.
inline void write_foreign(const std::filesystem::path& path, const openvdb::GridPtrVec& grids,
                          const openvdb::MetaMap& metadata = {},
                          std::uint32_t compression = openvdb::io::COMPRESS_BLOSC |
                                                      openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.setCompression(compression);
  file.write(grids, metadata);
  file.close();
}

/// Same active voxels and tiles, same values, same background.
template <class Pointer>
bool same_grid(const Pointer& a, const Pointer& b) {
  if (!a || !b) return !a && !b;
  if (a->activeVoxelCount() != b->activeVoxelCount() || a->background() != b->background()) return false;
  if (a->transform() != b->transform() || a->getName() != b->getName()) return false;
  for (auto value = a->cbeginValueOn(); value; ++value) {
    const openvdb::Coord at = value.getCoord();
    if (!b->tree().isValueOn(at) || b->tree().getValue(at) != *value) return false;
  }
  return true;
}

inline bool same_scene(const VdbScene& a, const VdbScene& b) {
  const VdbScene::Grids &x = a.grids(), &y = b.grids();
  bool same = x.basis == y.basis && x.harmonics_degree == y.harmonics_degree &&
              x.brightness.size() == y.brightness.size() && same_grid(x.extinction, y.extinction) &&
              same_grid(x.extinction_back, y.extinction_back) && same_grid(x.scattering, y.scattering) &&
              same_grid(x.normal, y.normal) && same_grid(x.exponent, y.exponent) &&
              same_grid(x.component, y.component);
  for (std::size_t n = 0; same && n < x.brightness.size(); ++n) {
    same = same_grid(x.brightness[n], y.brightness[n]);
  }
  return same;
}

inline bool same_volume(const Volume& a, const Volume& b) {
  const auto x = a.grid.view().values, y = b.grid.view().values;
  bool same = a.component == b.component && a.n_occupied_voxels == b.n_occupied_voxels &&
              a.support_m.min == b.support_m.min && a.support_m.max == b.support_m.max &&
              std::equal(x.begin(), x.end(), y.begin(), y.end()) &&
              a.grid.topology().n_bricks() == b.grid.topology().n_bricks() &&
              a.grid.transform().origin_m == b.grid.transform().origin_m &&
              a.grid.transform().voxel_size_m == b.grid.transform().voxel_size_m;
  for (std::uint32_t n = 0; same && n < a.grid.topology().n_bricks(); ++n) {
    same = a.grid.topology().coordinate(n) == b.grid.topology().coordinate(n);
  }
  return same;
}

/// Channel of a voxel; 0 where there is no brick.
inline float value_at(const Volume& volume, const glm::ivec3& voxel, int channel) {
  const std::uint32_t brick = volume.grid.topology().find(brick_of_voxel(voxel));
  return brick == kNoBrick ? 0.0f : volume.grid.view().voxel(brick, offset_in_brick(voxel))[channel];
}

}  // namespace sarnerf::test
