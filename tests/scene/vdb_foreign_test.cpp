// SPDX-License-Identifier: Apache-2.0
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <algorithm>
#include <cmath>

#include "catch.h"
#include "vdb/vdb_grids.h"
#include "vdb_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

const openvdb::Vec3f kCentre(2.0f, 3.0f, -4.0f);
constexpr float kRadius = 3.0f, kVoxel = 0.25f;

openvdb::FloatGrid::Ptr level_set(float half_width = 3.0f) {
  openvdb::initialize();
  auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kRadius, kCentre, kVoxel, half_width);
  sphere->setName("surface");
  return sphere;
}

openvdb::FloatGrid::Ptr fog() {
  auto sphere = level_set();
  openvdb::tools::sdfToFogVolume(*sphere);
  sphere->setName("density");
  return sphere;
}

glm::ivec3 nearest_voxel(const Volume& volume, const glm::dvec3& point_m) {
  return glm::ivec3(glm::round(volume.grid.transform().index_from_world(point_m)));
}

/// How far the outermost voxels with extinction lie from `centre_m`, and how many there are.
struct Extent {
  double nearest_m = 1e30, farthest_m = 0.0;
  std::uint64_t n = 0;
};
Extent extent_around(const Volume& volume, const glm::dvec3& centre_m) {
  Extent extent;
  const auto view = volume.grid.view();
  for (std::uint32_t b = 0; b < volume.grid.topology().n_bricks(); ++b) {
    for (int n = 0; n < kBrickVoxels; ++n) {
      if (view.voxel(b, n)[0] <= 0.0f) continue;
      const glm::ivec3 at =
          volume.grid.topology().coordinate(b) * kBrickSide + voxel_in_brick(n);
      const double r = glm::length(volume.grid.transform().world_from_index(glm::dvec3(at)) - centre_m);
      extent.nearest_m = std::min(extent.nearest_m, r);
      extent.farthest_m = std::max(extent.farthest_m, r);
      ++extent.n;
    }
  }
  return extent;
}

VdbScene read_back(const openvdb::GridPtrVec& grids, const VdbReadOptions& options = {},
                   std::uint32_t compression = openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK) {
  const ScratchFolder folder;
  write_foreign(folder.path() / "foreign.vdb", grids, {}, compression);
  return read_vdb(folder.path() / "foreign.vdb", options);
}

}  // namespace

TEST_CASE("a fog sphere becomes extinction and scattering", "[vdb]") {
  VdbReadOptions options;
  options.extinction_per_density = 0.3;
  options.albedo = 0.5;
  const auto density = fog();
  const VdbScene scene = read_back({density}, options);
  CHECK(has_line(scene.notes, "taken for fog: one-way extinction = density × 0.3 per metre"));
  const Volume volume = to_volume(scene);
  REQUIRE(volume.channels.basis == SourceBasis::scattering);
  const glm::ivec3 centre = nearest_voxel(volume, {2, 3, -4});
  CHECK(value_at(volume, centre, 0) == 0.3f);  // an interior tile: density 1
  CHECK(value_at(volume, centre, 1) == 0.15f);
  for (auto voxel = density->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord c = voxel.getCoord();
    REQUIRE(value_at(volume, {c.x(), c.y(), c.z()}, 0) == *voxel * 0.3f);
  }
  // All voxels whose density is not 0: the sphere, 7238 voxels of (0.25 m)³.
  const Extent extent = extent_around(volume, {2, 3, -4});
  CHECK(double(extent.n) == Approx(4.0 / 3.0 * M_PI * std::pow(kRadius / kVoxel, 3)).epsilon(0.02));
  CHECK(extent.farthest_m == Approx(kRadius).margin(kVoxel));
}

TEST_CASE("fog is read whatever its compression, and as half floats", "[vdb]") {
  const Volume expected = to_volume(read_back({fog()}));
  for (const std::uint32_t compression : {0u, 1u, 2u, 3u, 4u, 6u}) {
    INFO("compression " << compression);
    CHECK(same_volume(expected, to_volume(read_back({fog()}, {}, compression))));
  }
  for (const std::uint32_t compression : {0u, 3u, 6u}) {
    const auto short_floats = fog();
    short_floats->setSaveFloatAsHalf(true);
    const Volume volume = to_volume(read_back({short_floats}, {}, compression));
    REQUIRE(volume.grid.view().values.size() == expected.grid.view().values.size());
    double largest = 0.0;
    for (std::size_t n = 0; n < volume.grid.view().values.size(); ++n) {
      largest = worse(largest, std::abs(volume.grid.view().values[n] - expected.grid.view().values[n]));
    }
    CHECK(largest < 1e-3);
  }
}

TEST_CASE("distances as large as floats get give normals all the same", "[vdb]") {
  auto sphere = level_set();
  // Two voxels apart along y the sign changes, and the difference is beyond all floats.
  for (auto voxel = sphere->beginValueOn(); voxel; ++voxel) {
    const openvdb::Coord at = voxel.getCoord();
    if (at.x() % 3 == 0) voxel.setValue((at.y() >> 1 & 1) != 0 ? 3e38f : -3e38f);
  }
  const ScratchFolder folder;
  write_foreign(folder.path() / "a.vdb", {sphere});
  const Volume volume = to_volume(read_vdb(folder.path() / "a.vdb", {}));
  REQUIRE(volume.n_occupied_voxels > 0);
  const auto values = volume.grid.view().values;
  CHECK(std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); }));
}

TEST_CASE("a level set becomes an opaque solid", "[vdb]") {
  const VdbScene scene = read_back({level_set()});
  CHECK(has_line(scene.notes, "taken for the surface of an opaque solid"));
  const Volume volume = to_volume(scene);
  REQUIRE(volume.channels.basis == SourceBasis::cosine);
  const glm::dvec3 centre(2, 3, -4);
  const auto view = volume.grid.view();
  std::size_t n_checked = 0;
  for (std::uint32_t b = 0; b < volume.grid.topology().n_bricks(); ++b) {
    for (int n = 0; n < kBrickVoxels; ++n) {
      const glm::ivec3 at =
          volume.grid.topology().coordinate(b) * kBrickSide + voxel_in_brick(n);
      const glm::dvec3 radius = volume.grid.transform().world_from_index(glm::dvec3(at)) - centre;
      const double depth = (kRadius - glm::length(radius)) / kVoxel;
      if (std::abs(depth) > 1.9) continue;
      const float* voxel = view.voxel(b, n);
      REQUIRE(voxel[0] == Approx(0.5 * opaque_extinction_per_voxel(float(depth)) / kVoxel).margin(1e-2));
      REQUIRE(voxel[1] == 1.0f);
      REQUIRE(glm::dot(glm::dvec3(voxel[2], voxel[3], voxel[4]), radius / glm::length(radius)) > 0.999);
      REQUIRE(voxel[5] == 1.0f);
      ++n_checked;
    }
  }
  CHECK(n_checked > 5000);
  CHECK(extent_around(volume, centre).nearest_m > kRadius - 3.5 * kVoxel);  // a shell
}

TEST_CASE("units and scale place a foreign volume; a solid stays opaque", "[vdb]") {
  VdbReadOptions options;
  options.units_m = 0.01;
  options.scale = 2.0;
  const Volume volume = to_volume(read_back({level_set()}, options));
  CHECK(volume.grid.transform().voxel_size_m == Approx(0.005));
  const Extent extent = extent_around(volume, {0.04, 0.06, -0.08});
  CHECK(extent.farthest_m == Approx(0.06).margin(0.005));
  const float deepest = *std::max_element(volume.grid.view().values.begin(), volume.grid.view().values.end());
  CHECK(2.0 * deepest * 0.005 == Approx(kOpaqueDepthPerVoxel));
}

TEST_CASE("our own volumes keep their optical depths under a scale", "[vdb]") {
  const ScratchFolder folder;
  const VdbScene scene(scattering_grids());
  write_vdb(scene, folder.path() / "a.vdb");
  VdbReadOptions options;
  options.scale = 4.0;
  options.units_m = 0.01;  // the file says metres
  const VdbScene scaled = read_vdb(folder.path() / "a.vdb", options);
  CHECK(has_line(scaled.notes, "--units is not used"));
  const Volume a = to_volume(scene), b = to_volume(scaled);
  CHECK(b.grid.transform().voxel_size_m == 2.0);
  CHECK(b.support_m.min.x == Approx(4.0 * a.support_m.min.x));
  for (std::size_t n = 0; n < a.grid.view().values.size(); ++n) {
    REQUIRE(b.grid.view().values[n] == 0.25f * a.grid.view().values[n]);
  }
}

TEST_CASE("z up turns to y up: (x, y, z) becomes (x, z, -y)", "[vdb]") {
  VdbReadOptions options;
  options.up = UpAxis::z;
  auto density = fog();
  density->tree().addTile(2, {1024, 0, -128}, 0.5f, true);
  const Volume volume = to_volume(read_back({density}, options)), as_is = to_volume(read_back({density}));
  CHECK(volume.n_occupied_voxels == as_is.n_occupied_voxels);
  const double voxel = volume.grid.transform().voxel_size_m;
  for (auto value = density->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d p = density->indexToWorld(value.getCoord());
    const glm::dvec3 turned(p.x(), p.z(), -p.y());
    const glm::ivec3 at = nearest_voxel(volume, turned);
    REQUIRE(glm::length(volume.grid.transform().world_from_index(glm::dvec3(at)) - turned) < 1e-6 * voxel);
    REQUIRE(value_at(volume, at, 0) == *value);
  }
  const glm::dvec3 in_tile(1100 * double(kVoxel), -5 * double(kVoxel), -100 * double(kVoxel));
  CHECK(value_at(volume, nearest_voxel(volume, in_tile), 0) == 0.5f);
  const Volume solid = to_volume(read_back({level_set()}, options));
  const glm::ivec3 top = nearest_voxel(solid, {2, -4 + 3, -3});
  CHECK(value_at(solid, top, 3) == Approx(1.0).margin(1e-3));  // the normal points up
}

TEST_CASE("a file that says z up turns its normals and its box, too", "[vdb]") {
  const ScratchFolder folder;
  auto grids = cosine_grids();
  openvdb::MetaMap metadata;
  metadata.insertMeta("brightness_basis", openvdb::StringMetadata("cosine"));
  metadata.insertMeta("up_axis", openvdb::StringMetadata("z"));
  metadata.insertMeta("scene_box_min_m", openvdb::Vec3DMetadata({1, 2, 3}));
  metadata.insertMeta("scene_box_max_m", openvdb::Vec3DMetadata({4, 6, 8}));
  write_foreign(folder.path() / "a.vdb", grids->all(), metadata);
  const Volume volume = to_volume(read_vdb(folder.path() / "a.vdb", {}));
  CHECK(volume.box_m.min == glm::dvec3(1, 3, -6));
  CHECK(volume.box_m.max == glm::dvec3(4, 8, -2));
  for (auto value = grids->normal->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d p = grids->normal->indexToWorld(value.getCoord());
    const glm::ivec3 at = nearest_voxel(volume, {p.x(), p.z(), -p.y()});
    const openvdb::Vec3s n = *value;
    REQUIRE(glm::vec3(value_at(volume, at, 2), value_at(volume, at, 3), value_at(volume, at, 4)) ==
            glm::vec3(n.x(), n.z(), -n.y()));
  }
}

TEST_CASE("swapped and mirrored axes are put right", "[vdb]") {
  const openvdb::math::Mat4d mirrored(0.0, 0.0, 0.5, 0.0,   //
                                      -0.5, 0.0, 0.0, 0.0,  //
                                      0.0, 0.5, 0.0, 0.0,   //
                                      7.0, 8.0, 9.0, 1.0);
  auto density = fog();
  density->setTransform(openvdb::math::Transform::createLinearTransform(mirrored));
  const Volume volume = to_volume(read_back({density}));
  for (auto value = density->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d p = density->indexToWorld(value.getCoord());
    const glm::ivec3 at = nearest_voxel(volume, {p.x(), p.y(), p.z()});
    REQUIRE(value_at(volume, at, 0) == *value);
  }
  CHECK(volume.n_occupied_voxels == density->activeVoxelCount());
}

TEST_CASE("one volume is chosen from several", "[vdb]") {
  auto heat = fog();
  heat->setName("temperature");
  const VdbScene scene = read_back({heat, fog(), level_set()});
  CHECK(has_line(scene.notes, "grid 'density': taken for fog"));
  CHECK(has_line(scene.notes, "other grids are not used"));
  CHECK(contains(message_of<InputError>([&] {
          auto steam = fog();
          steam->setName("steam");
          read_back({heat, steam});
        }),
        "expected one volume, or one called \"density\""));
}

TEST_CASE("grids that share one tree in the file have one each when read", "[vdb]") {
  const ScratchFolder folder;
  auto grids = scattering_grids();
  auto twin = openvdb::FloatGrid::create(grids->extinction->treePtr());
  twin->setName("scattering");
  twin->setTransform(grids->extinction->transform().copy());
  write_foreign(folder.path() / "a.vdb", {grids->extinction, twin});
  const VdbScene scene = read_vdb(folder.path() / "a.vdb", {});
  CHECK(has_line(scene.notes, "has no metadata 'format'"));
  CHECK(scene.grids().scattering->treePtr() != scene.grids().extinction->treePtr());
  const Volume volume = to_volume(scene);
  for (std::size_t n = 0; n < volume.grid.view().values.size(); n += 2) {
    REQUIRE(volume.grid.view().values[n] == volume.grid.view().values[n + 1]);
  }
}
