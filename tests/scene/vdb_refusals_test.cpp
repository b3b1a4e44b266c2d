// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "catch.h"
#include "vdb_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

openvdb::MetaMap with_basis(const std::string& basis) {
  openvdb::MetaMap metadata;
  metadata.insertMeta("brightness_basis", openvdb::StringMetadata(basis));
  return metadata;
}

/// What reading a file of these grids complains about; "" when it reads them.
std::string complaint(const openvdb::GridPtrVec& grids, const openvdb::MetaMap& metadata = {},
                      const VdbReadOptions& options = {}) {
  const ScratchFolder folder;
  write_foreign(folder.path() / "bad.vdb", grids, metadata);
  return message_of<InputError>([&] { read_vdb(folder.path() / "bad.vdb", options); });
}

openvdb::FloatGrid::Ptr floats(const std::string& name) { return random_floats(name, 3, 0.0f, 1.0f); }

openvdb::FloatGrid::Ptr density_with(const openvdb::math::Mat4d& transform) {
  auto grid = floats("density");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(transform));
  return grid;
}

}  // namespace

TEST_CASE("files without a volume are refused with what they hold", "[vdb]") {
  auto mask = grid_at<openvdb::BoolGrid>(kLattice, "mask");
  mask->tree().setValue({1, 2, 3}, true);
  const std::string message = complaint({mask, floats("heat")});
  CHECK(contains(message, "bad.vdb: expected grids \"extinction\""));
  CHECK(contains(message, "'mask' (bool, 'unknown'), 'heat' (float, 'unknown')"));
  CHECK(contains(complaint({}), "found a file without grids"));
}

TEST_CASE("other types than float are refused by name", "[vdb]") {
  auto doubles = grid_at<openvdb::DoubleGrid>(kLattice, "density");
  doubles->tree().setValue({0, 0, 0}, 1.0);
  CHECK(contains(complaint({doubles}), "grid 'density': expected values of type float, found double"));
  auto vectors = grid_at<openvdb::Vec3SGrid>(kLattice, "density");
  vectors->tree().setValue({0, 0, 0}, openvdb::Vec3s(1.0f));
  CHECK(contains(complaint({vectors}), "expected values of type float, found vec3s"));
  CHECK(contains(complaint({doubles, floats("extinction"), vectors}), "found neither"));
}

TEST_CASE("values without meaning are counted and the first one is named", "[vdb]") {
  auto density = floats("density");
  density->tree().setValue({4, 5, 6}, std::numeric_limits<float>::quiet_NaN());
  density->tree().setValue({40, 5, 6}, -1.0f);
  density->tree().setValue({80, 5, 6}, std::numeric_limits<float>::infinity());
  CHECK(contains(complaint({density}),
                 "grid 'density': expected finite values of at least 0, found 3 voxels that are not, the "
                 "first at index (4, 5, 6): NaN"));
  auto tiled = floats("density");
  tiled->tree().addTile(1, {64, 0, 0}, -2.0f, true);
  CHECK(contains(complaint({tiled}), "found 512 voxels that are not, the first at index (64, 0, 0): -2"));
  VdbReadOptions options;
  options.extinction_per_density = 1e30;
  auto dense = floats("density");
  dense->tree().setValue({0, 0, 0}, 1e10f);
  CHECK(contains(complaint({dense}, {}, options), "found 1 voxel that is not"));
}

TEST_CASE("a background that is not 0 would fill the world", "[vdb]") {
  auto density = openvdb::FloatGrid::create(0.5f);
  density->setName("density");
  density->tree().setValue({0, 0, 0}, 1.0f);
  CHECK(contains(complaint({density}), "expected 0 outside of the active voxels, found the background value 0.5"));
}

TEST_CASE("transforms other than uniform scale and translation are refused", "[vdb]") {
  const double s = std::sqrt(0.5);
  const openvdb::math::Mat4d turned(s, s, 0.0, 0.0, -s, s, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
  const openvdb::math::Mat4d sheared(1.0, 0.2, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
  const openvdb::math::Mat4d stretched(1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
  CHECK(contains(complaint({density_with(turned)}), "found a rotated or sheared one; resample the grid"));
  CHECK(contains(complaint({density_with(sheared)}), "found a rotated or sheared one"));
  CHECK(contains(complaint({density_with(stretched)}), "found voxels of 1.000000 by 2.000000 m"));
  auto frustum = floats("density");
  frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(100)), 0.5, 10.0));
  CHECK(contains(complaint({frustum}), "found a perspective or unknown one"));
}

TEST_CASE("voxels too small for OpenVDB, and volumes out of reach, are refused and not thrown at", "[vdb]") {
  VdbReadOptions options;
  options.units_m = 1e-6;
  CHECK(contains(complaint({floats("density")}, {}, options), "expected voxels of at least 2e-05 m"));
  options.units_m = 1e-4;
  CHECK(complaint({floats("density")}, {}, options).empty());
  options.units_m = 1e7;
  CHECK(contains(complaint({floats("density")}, {}, options), "within 1e+12 m"));
  CHECK_THROWS_AS(vdb_transform({glm::dvec3(0.0), 1e-6}), UsageError);
  CHECK_NOTHROW(vdb_transform({glm::dvec3(0.0), 2e-5}));
}

TEST_CASE("grids of one scene share their voxels", "[vdb]") {
  const auto other = [](const GridTransform& lattice) {
    return random_floats("scattering", 3, 0.0f, 1.0f, lattice);
  };
  const std::string expected = "expected all grids on the same voxels, found 'scattering'";
  CHECK(contains(complaint({floats("extinction"), other({kLattice.origin_m, 0.25})}), expected));
  CHECK(contains(complaint({floats("extinction"), other({kLattice.origin_m + 0.1, 0.5})}), expected));
  CHECK(complaint({floats("extinction"), other(kLattice)}).empty());
}

TEST_CASE("names and basis must tell one story", "[vdb]") {
  const auto k = floats("extinction"), p = floats("scattering"), b = floats("brightness");
  CHECK(contains(complaint({k}), "found neither; a volume without them returns no backscatter"));
  CHECK(contains(complaint({k, p, b}, with_basis("isotropic")), "found both"));
  CHECK(contains(complaint({k, b}), "expected metadata brightness_basis (isotropic, sh or cosine)"));
  CHECK(contains(complaint({k, b}, with_basis("plaid")), "found 'plaid'"));
  CHECK(contains(complaint({k, p}, with_basis("sh")), "but no grid \"brightness\""));
  CHECK(contains(complaint({b}, with_basis("sh")), "expected \"extinction\" beside \"brightness\""));
  CHECK(contains(complaint({k, b, floats("brightness_1")}, with_basis("sh")), "1, 4 or 9 grids"));
  CHECK(contains(complaint({k, b, floats("brightness_1")}, with_basis("isotropic")), "expected 1 grids"));
  CHECK(contains(complaint({k, b, floats("brightness_2")}, with_basis("sh")),
                 "found \"brightness_2\" but not \"brightness_1\""));
  CHECK(contains(complaint({k, b}, with_basis("cosine")), "expected \"normal\" and \"exponent\""));
  CHECK(contains(complaint({k, floats("extinction"), p}), "found several"));
  auto component = grid_at<openvdb::Int32Grid>(kLattice, "component");
  component->tree().setValue({0, 0, 0}, 7);
  CHECK(contains(complaint({k, p, component}), "expected components 0 to 4, found 1 voxel that is not"));
}

TEST_CASE("metadata that is not understood is refused", "[vdb]") {
  const auto with = [](const char* name, const openvdb::Metadata& value) {
    openvdb::MetaMap metadata;
    metadata.insertMeta("format", openvdb::StringMetadata("sarnerf-volume"));
    metadata.insertMeta("version", openvdb::Int32Metadata(1));
    metadata.removeMeta(name);
    metadata.insertMeta(name, value);
    return complaint({floats("extinction"), floats("scattering")}, metadata);
  };
  CHECK(with("provenance", openvdb::StringMetadata("x")).empty());
  CHECK(contains(with("version", openvdb::Int32Metadata(2)), "expected version 1 of the format, found 2"));
  CHECK(contains(with("format", openvdb::StringMetadata("other")), "expected the format \"sarnerf-volume\""));
  CHECK(contains(with("up_axis", openvdb::StringMetadata("w")), "expected up_axis \"y\" or \"z\""));
  CHECK(contains(with("units", openvdb::StringMetadata("ft")), "expected units \"m\""));
}

TEST_CASE("level sets whose band is too narrow are refused", "[vdb]") {
  auto thin = openvdb::FloatGrid::create(0.6f);
  thin->setName("surface");
  thin->setGridClass(openvdb::GRID_LEVEL_SET);
  thin->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  thin->tree().setValue({0, 0, 0}, -0.1f);
  CHECK(contains(complaint({thin}), "whose band reaches 2 voxels to both sides"));
}

TEST_CASE("harmonics with z up are refused, normals are turned", "[vdb]") {
  auto metadata = with_basis("sh");
  metadata.insertMeta("up_axis", openvdb::StringMetadata("z"));
  openvdb::GridPtrVec grids{floats("extinction"), floats("brightness")};
  for (int n = 1; n < 4; ++n) grids.push_back(floats("brightness_" + std::to_string(n)));
  CHECK(contains(complaint(grids, metadata), "expected harmonics in axes with y up"));
}

TEST_CASE("reading keeps to the memory allowed", "[vdb]") {
  const ScratchFolder folder;
  auto density = floats("density");
  density->tree().voxelizeActiveTiles();
  for (int n = 0; n < 64; ++n) density->tree().setValue({100 * n, 0, 0}, 1.0f);
  write_foreign(folder.path() / "a.vdb", {density});
  VdbReadOptions options;
  options.max_memory_bytes = 300'000;
  const std::string message = message_of<UsageError>([&] { read_vdb(folder.path() / "a.vdb", options); });
  CHECK(contains(message, "300 kB are available (--max-memory)"));
  options.max_memory_bytes = 50'000'000;
  CHECK_NOTHROW(read_vdb(folder.path() / "a.vdb", options));
}
