// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "catch.h"
#include "file_size_limit.h"
#include "vdb_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Writes, reads, compares; and the same once more from what was read.
void check_round_trip(std::unique_ptr<VdbScene::Grids> grids) {
  VdbScene scene(std::move(grids));
  scene.set_metadata("provenance", "a test");
  scene.set_metadata("reference_bin_m", 0.203);
  scene.scene_box_m = {{-1.1, 0.3, 999'990.7}, {12.2, 7.9, 1'000'010.3}};
  const ScratchFolder folder;
  const auto first = folder.path() / "first.vdb", second = folder.path() / "second.vdb";
  write_vdb(scene, first);
  const VdbScene read = read_vdb(first, {});
  CHECK(same_scene(scene, read));
  CHECK(read.notes.empty());
  CHECK(read.scene_box_m.min == scene.scene_box_m.min);
  CHECK(read.scene_box_m.max == scene.scene_box_m.max);
  CHECK(same_volume(to_volume(scene), to_volume(read)));
  const auto entry = read.grids().metadata.getMetadata<openvdb::StringMetadata>("provenance");
  REQUIRE(entry);
  CHECK(entry->value() == "a test");
  const auto bin = read.grids().metadata.getMetadata<openvdb::DoubleMetadata>("reference_bin_m");
  REQUIRE(bin);
  CHECK(bin->value() == 0.203);
  write_vdb(read, second);
  CHECK(bytes_of(first) == bytes_of(second));
}

}  // namespace

TEST_CASE("volumes of every basis come back bit for bit, and so do their files", "[vdb]") {
  SECTION("scattering") { check_round_trip(scattering_grids()); }
  SECTION("scattering without extinction") {
    auto grids = scattering_grids();
    grids->extinction = nullptr;
    check_round_trip(std::move(grids));
  }
  SECTION("two extinctions") {
    auto grids = scattering_grids();
    grids->extinction_back = random_floats("extinction_back", 9, 0.0f, 4.0f);
    check_round_trip(std::move(grids));
  }
  SECTION("isotropic") { check_round_trip(harmonics_grids(0)); }
  SECTION("harmonics of degree 1") { check_round_trip(harmonics_grids(1)); }
  SECTION("harmonics of degree 2") { check_round_trip(harmonics_grids(2)); }
  SECTION("cosine with components") { check_round_trip(cosine_grids()); }
  SECTION("tiles of all sizes") {
    auto grids = scattering_grids();
    for (const auto& grid : {grids->extinction, grids->scattering}) {
      grid->tree().addTile(1, {64, 0, 0}, 0.25f, true);
      grid->tree().addTile(2, {128, 0, -128}, 0.5f, true);
    }
    check_round_trip(std::move(grids));
  }
}

TEST_CASE("channels of a volume are the values of its grids", "[vdb]") {
  const VdbScene scene(cosine_grids());
  const VdbScene::Grids& grids = scene.grids();
  const Volume volume = to_volume(scene);
  REQUIRE(volume.channels.count() == 6);
  CHECK(volume.channels.basis == SourceBasis::cosine);
  std::uint64_t n_occupied = 0;
  for (auto voxel = grids.extinction->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord c = voxel.getCoord();
    const glm::ivec3 at(c.x(), c.y(), c.z());
    n_occupied += *voxel > 0.0f;
    REQUIRE(value_at(volume, at, 0) == *voxel);
    REQUIRE(value_at(volume, at, 1) == grids.brightness[0]->tree().getValue(c));
    for (int axis = 0; axis < 3; ++axis) {
      REQUIRE(value_at(volume, at, 2 + axis) == grids.normal->tree().getValue(c)[axis]);
    }
    REQUIRE(value_at(volume, at, 5) == grids.exponent->tree().getValue(c));
    const std::size_t brick = volume.grid.topology().find(brick_of_voxel(at));
    const std::size_t place = brick * kBrickVoxels + static_cast<std::size_t>(offset_in_brick(at));
    REQUIRE(static_cast<std::int32_t>(volume.component[place]) == grids.component->tree().getValue(c));
  }
  CHECK(volume.n_occupied_voxels == n_occupied);
}

TEST_CASE("the support reaches one voxel around what is occupied", "[vdb]") {
  auto grids = std::make_unique<VdbScene::Grids>();
  grids->basis = SourceBasis::scattering;
  grids->extinction = grid_at<openvdb::FloatGrid>(kLattice, "extinction");
  grids->scattering = grid_at<openvdb::FloatGrid>(kLattice, "scattering");
  grids->extinction->tree().setValue({-3, 4, 5}, 1.0f);
  grids->extinction->tree().setValue({100, 100, 100}, 0.0f);  // active, but nothing is there
  grids->scattering->tree().setValue({7, 4, 2}, 1.0f);        // scatters without taking anything out
  const Volume volume = to_volume(VdbScene(std::move(grids)));
  CHECK(volume.n_occupied_voxels == 2);
  CHECK(volume.support_m.min == kLattice.world_from_index({-4, 3, 1}));
  CHECK(volume.support_m.max == kLattice.world_from_index({8, 5, 6}));
  CHECK(volume.box_m.min == kLattice.world_from_index({-3, 4, 2}));
  CHECK(volume.box_m.max == kLattice.world_from_index({7, 4, 5}));
  CHECK(volume.grid.topology().n_bricks() == 2);
}

TEST_CASE("bricks of attributes are kept where a cell with matter reaches them, and nowhere else", "[vdb]") {
  auto grids = harmonics_grids(0);
  grids->extinction->clear();
  grids->brightness[0]->clear();
  grids->extinction->tree().setValue({7, 7, 3}, 1.0f);  // the edge towards +x and +y
  for (int x = -16; x < 32; ++x) {
    for (int y = -16; y < 32; ++y) {
      for (int z = -16; z < 32; ++z) grids->brightness[0]->tree().setValue({x, y, z}, 0.5f);
    }
  }
  const Volume volume = to_volume(VdbScene(std::move(grids)));
  CHECK(volume.grid.topology().n_bricks() == 4);
  for (const glm::ivec3& brick : {glm::ivec3(0), glm::ivec3(1, 0, 0), glm::ivec3(0, 1, 0), glm::ivec3(1, 1, 0)}) {
    CHECK(volume.grid.topology().find(brick) != kNoBrick);
  }
  CHECK(value_at(volume, {8, 8, 4}, 1) == 0.5f);
}

TEST_CASE("memory follows what is occupied, not the space between", "[vdb]") {
  const auto bytes_with_gap = [](int gap) {
    auto grids = scattering_grids();
    grids->extinction->tree().setValue({gap, gap, gap}, 1.0f);
    return to_volume(VdbScene(std::move(grids))).memory_bytes();
  };
  CHECK(bytes_with_gap(100'000) == bytes_with_gap(200'000));
}

TEST_CASE("active tiles become voxels, within the memory allowed", "[vdb]") {
  const auto with_tile = [](int level) {
    auto grids = scattering_grids();
    grids->extinction->tree().addTile(static_cast<openvdb::Index>(level), {4096, 0, 0}, 0.25f, true);
    return VdbScene(std::move(grids));
  };
  const Volume volume = to_volume(with_tile(2));  // 128³ voxels
  CHECK(value_at(volume, {4096, 0, 0}, 0) == 0.25f);
  CHECK(value_at(volume, {4096 + 127, 127, 127}, 0) == 0.25f);
  CHECK(value_at(volume, {4096 + 128, 0, 0}, 0) == 0.0f);
  CHECK(volume.n_occupied_voxels > 128u * 128u * 128u);

  const std::uint64_t limit = 10'000'000;
  const std::string message = message_of<UsageError>([&] { to_volume(with_tile(2), limit); });
  CHECK(contains(message, "and 10 MB are available (--max-memory), enough with voxels of 0."));
  CHECK(contains(message, "use larger voxels"));
  // A tile of 4096³ voxels is refused by its size alone: nothing of it is allocated.
  CHECK(contains(message_of<UsageError>([&] { to_volume(with_tile(3), limit); }), "134,217,728 bricks"));
}

TEST_CASE("what a volume needs is what was asked for", "[vdb]") {
  const VdbScene scene(cosine_grids());
  const Volume volume = to_volume(scene);
  const std::uint64_t enough = volume.memory_bytes() * 11 / 10;
  CHECK(same_volume(volume, to_volume(scene, enough)));
  CHECK_THROWS_AS(to_volume(scene, volume.memory_bytes() * 9 / 10), UsageError);
}

TEST_CASE("grids that do not fit together are not written and not sampled", "[vdb]") {
  auto grids = cosine_grids();
  grids->normal = nullptr;
  const VdbScene scene(std::move(grids));
  const ScratchFolder folder;
  CHECK_THROWS_AS(to_volume(scene), UsageError);
  CHECK_THROWS_AS(write_vdb(scene, folder.path() / "a.vdb"), UsageError);
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("a volume that cannot be written is an error with its path", "[vdb]") {
  const VdbScene scene(scattering_grids());
  CHECK(contains(message_of<Error>([&] { write_vdb(scene, "/nowhere/at/all.vdb"); }), "/nowhere/at/all.vdb"));
}

TEST_CASE("a disk that fills up under a volume leaves what was there, and no temporary file", "[vdb]") {
  const ScratchFolder folder;
  const auto path = folder.write("a.vdb", "old");
  const VdbScene scene(scattering_grids());
  write_vdb(scene, folder.path() / "whole.vdb");
  const auto size = std::filesystem::file_size(folder.path() / "whole.vdb");
  std::filesystem::remove(folder.path() / "whole.vdb");
  // Cut in the head, in the midst of the values, and at the very end.
  for (const std::uintmax_t limit : {std::uintmax_t{10}, size / 2, size - 1}) {
    INFO("limit " << limit << " of " << size);
    std::string message;
    {
      const FileSizeLimit full(limit);
      message = message_of<Error>([&] { write_vdb(scene, path); });
    }
    CHECK(contains(message, path.string() + ": the volume cannot be written"));
    CHECK(contains(message, "free some space"));
    CHECK(bytes_of(path) == "old");
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
  }
  write_vdb(scene, path);
  CHECK(std::filesystem::file_size(path) == size);
}

TEST_CASE("the summary says what a scene holds", "[vdb]") {
  VdbScene scene(cosine_grids());
  scene.set_metadata("provenance", "a test");
  const VdbSummary summary = scene.summary();
  CHECK(summary.voxel_size_m == 0.5);
  REQUIRE(summary.grids.size() == 5);
  CHECK(summary.grids[0].name == "extinction");
  CHECK(summary.grids[0].type == "float");
  CHECK(summary.grids[0].n_active_voxels == scene.grids().extinction->activeVoxelCount());
  CHECK(summary.grids[0].memory_bytes > 0);
  const openvdb::CoordBBox box = scene.grids().extinction->evalActiveVoxelBoundingBox();
  CHECK(summary.grids[0].box_m.min.x == 3.25 + 0.5 * (box.min().x() - 0.5));
  CHECK(summary.grids[0].box_m.max.y == -1.5 + 0.5 * (box.max().y() + 0.5));
  REQUIRE(summary.metadata.size() == 1);
  CHECK(summary.metadata[0].first == "provenance");
  CHECK(summary.metadata[0].second == "a test");
}

TEST_CASE("reading and filling stop on request", "[vdb]") {
  const ScratchFolder folder;
  const VdbScene scene(scattering_grids());
  write_vdb(scene, folder.path() / "a.vdb");
  const std::atomic<bool> stop{true};
  VdbReadOptions options;
  options.monitor.stop = &stop;
  CHECK_THROWS_AS(read_vdb(folder.path() / "a.vdb", options), Interrupted);
  CHECK_THROWS_AS(to_volume(scene, 0, options.monitor), Interrupted);
}
