// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <random>
#include <tuple>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/field/brick_grid.h"

using namespace sarnerf;

TEST_CASE("bricks and places in them, on both sides of 0") {
  CHECK(brick_of_voxel({0, 7, 8}) == glm::ivec3(0, 0, 1));
  CHECK(brick_of_voxel({-1, -8, -9}) == glm::ivec3(-1, -1, -2));
  CHECK(offset_in_brick({0, 0, 0}) == 0);
  CHECK(offset_in_brick({0, 0, 1}) == 1);
  CHECK(offset_in_brick({0, 1, 0}) == 8);
  CHECK(offset_in_brick({1, 0, 0}) == 64);
  CHECK(offset_in_brick({-1, -1, -1}) == 511);
  for (int offset = 0; offset < kBrickVoxels; ++offset) {
    const glm::ivec3 voxel = voxel_in_brick(offset);
    REQUIRE(offset_in_brick(voxel) == offset);
    REQUIRE(brick_of_voxel(voxel) == glm::ivec3(0));
    REQUIRE(voxel_in_brick(std::size_t{7} * kBrickVoxels + static_cast<std::size_t>(offset)) == voxel);
  }
  CHECK(offset_in_brick({-8, 16, -16}) == 0);
}

TEST_CASE("what was inserted is found, nothing else") {
  std::mt19937 random(1);
  for (int spread : {3, 40, 100000000}) {
    std::uniform_int_distribution<int> coordinate(-spread, spread);
    BrickTopology topology;
    std::map<std::tuple<int, int, int>, std::uint32_t> reference;
    CHECK(topology.find({0, 0, 0}) == kNoBrick);
    for (int n = 0; n < 3000; ++n) {
      const glm::ivec3 brick(coordinate(random), coordinate(random), coordinate(random));
      const auto next = static_cast<std::uint32_t>(reference.size());
      const auto [entry, added] = reference.try_emplace({brick.x, brick.y, brick.z}, next);
      REQUIRE(topology.insert(brick) == entry->second);
    }
    CHECK(topology.n_bricks() == reference.size());
    for (const auto& [at, number] : reference) {
      const glm::ivec3 brick(std::get<0>(at), std::get<1>(at), std::get<2>(at));
      REQUIRE(topology.find(brick) == number);
      REQUIRE(topology.coordinate(number) == brick);
      for (int n = 0; n < 8; ++n) {
        const auto beside =
            reference.find({brick.x + (n >> 2), brick.y + (n >> 1 & 1), brick.z + (n & 1)});
        const std::uint32_t expected = beside == reference.end() ? kNoBrick : beside->second;
        REQUIRE(topology.neighbours(number)[static_cast<std::size_t>(n)] == expected);
      }
    }
  }
}

TEST_CASE("empty space costs nothing") {
  BrickTopology near, far;
  for (int n = 0; n < 100; ++n) {
    near.insert({8 * n, 0, 0});  // a tile each
    far.insert({8 * n * 100003, -8 * n * 50021, 8 * n * 99991});
  }
  CHECK(near.memory_bytes() == far.memory_bytes());
  CHECK(far.memory_bytes() < 100 * 2 * 4096);
  // Bricks of one tile share its 2 KiB.
  BrickTopology dense;
  for (int n = 0; n < 512; ++n) dense.insert({n / 64, n / 8 % 8, n % 8});
  CHECK(dense.memory_bytes() < 2048 + 512 * 2 * (sizeof(glm::ivec3) + 32) + 1024);
}

TEST_CASE("bricks beyond the reach of voxels are refused") {
  BrickTopology topology;
  CHECK_NOTHROW(topology.insert({kMaxBrick, -kMaxBrick, 0}));
  CHECK_THROWS_AS(topology.insert({kMaxBrick + 1, 0, 0}), UsageError);
  CHECK_THROWS_AS(topology.insert({0, 0, -kMaxBrick - 1}), UsageError);
  CHECK(topology.n_bricks() == 1);
}

TEST_CASE("a grid keeps its values when it grows, and new bricks are 0") {
  BrickGrid<float> grid({}, 3);
  grid.touch_voxel({1, 2, 3})[1] = 5.0f;
  grid.touch_voxel({-100, 2, 3})[2] = 6.0f;
  CHECK(grid.touch_voxel({1, 2, 3})[1] == 5.0f);
  CHECK(grid.touch_voxel({-100, 2, 3})[2] == 6.0f);
  CHECK(grid.topology().n_bricks() == 2);
  CHECK(grid.view().values.size() == 2 * 512 * 3);
  float sum = 0.0f;
  for (float value : grid.view().values) sum += value;
  CHECK(sum == 11.0f);
}

TEST_CASE("a view looks at anybody's memory, of the right length") {
  BrickTopology topology;
  topology.insert({0, 0, 0});
  topology.insert({4, 0, 0});
  std::vector<float> tensor(2 * 512 * 5, 0.0f);
  BrickView<const float> view{&topology, {}, 5, tensor};
  CHECK_NOTHROW(validate(view));
  view.n_channels = 4;
  CHECK_THROWS_AS(validate(view), UsageError);
  view.n_channels = 0;
  CHECK_THROWS_AS(validate(view), UsageError);
  view = {nullptr, {}, 5, tensor};
  CHECK_THROWS_AS(validate(view), UsageError);
  view = {&topology, {glm::dvec3(0.0), 0.0}, 5, tensor};
  CHECK_THROWS_AS(validate(view), UsageError);
}
