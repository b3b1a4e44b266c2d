// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/bake/extract.h"

#include <cmath>
#include <numbers>

#include "../nerf/torch_catch.h"
#include "learned_volume.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/model_file.h"
#include "surface_checks.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kVoxel_m = 0.2;

/// What a field should hold at a voxel's centre.
struct Matter {
  double depth = 0.0;       ///< two-way, of a voxel; 0: none
  double brightness = 1.0;
};

/// A field in the frame of the aim point, voxels within ±4.8 m along x and z and up to 6.4 m above the ground.
template <class Of>
std::unique_ptr<GridField> field_of(const Of& matter_at) {
  const GridTransform transform{glm::dvec3(0.5 * kVoxel_m), kVoxel_m};
  auto field = std::make_unique<GridField>(transform, 2, 1.0);
  BrickTopology topology;
  std::vector<std::uint8_t> active;
  std::vector<float> log_depth, coefficients;
  for (int x = -3; x < 3; ++x)
    for (int y = -1; y < 4; ++y)
      for (int z = -3; z < 3; ++z) {
        topology.insert({x, y, z});
        for (int v = 0; v < kBrickVoxels; ++v) {
          const glm::ivec3 voxel = glm::ivec3(x, y, z) * kBrickSide + voxel_in_brick(v);
          const Matter matter = matter_at(transform.world_from_index(glm::dvec3(voxel)));
          active.push_back(matter.depth > 0.0 ? 1 : 0);
          if (active.back() == 0) continue;
          log_depth.push_back(static_cast<float>(std::log(matter.depth)));
          coefficients.push_back(static_cast<float>(std::sqrt(4.0 * std::numbers::pi) * matter.brightness));
        }
      }
  const auto n = static_cast<std::int64_t>(log_depth.size());
  torch::Tensor c = torch::zeros({n, 9});
  c.select(1, 0).copy_(torch::tensor(coefficients));
  field->set_voxels(std::move(topology), active, torch::tensor(log_depth), c);
  return field;
}

/// Seen from all sides at three incidences.
Model model_of(std::unique_ptr<GridField> field, const glm::dvec3& aim_m = glm::dvec3(0.0)) {
  Model model;
  model.info.program = "test";
  model.info.aim_m = aim_m;
  model.info.scene_box_m = {aim_m - 6.0, aim_m + 6.0};
  for (const double incidence_deg : {35.0, 45.0, 55.0})
    for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 20) {
      DatasetView view;
      view.azimuth_deg = azimuth_deg;
      view.incidence_deg = incidence_deg;
      view.slant_range_m = 5000.0;
      view.n_azimuth = view.n_range = 128;
      view.azimuth_spacing_m = view.range_spacing_m = 0.25;
      model.info.training_views.push_back(view);
    }
  model.field = std::move(field);
  return model;
}

/// The walls and the roof of a box of 6 × 3 × 4 m that stands on y = 0, opaque and two voxels thick; nobody sees more.
Matter hollow_box(const glm::dvec3& p) {
  const glm::dvec3 inside = glm::dvec3(3.0, 3.0, 2.0) - glm::dvec3(std::abs(p.x), p.y, std::abs(p.z));
  const double depth_m = std::min({inside.x, inside.y, inside.z});
  return {p.y > 0.0 && depth_m > 0.0 && depth_m < 2.0 * kVoxel_m ? 5.0 : 0.0};
}

ExtractOptions fine() {
  ExtractOptions options;
  options.resolution = 100;
  options.extent_m = 10.0;
  return options;
}

double volume_m3(const Extraction& x) { return signed_volume_m3(x.mesh); }

}  // namespace

TEST_CASE("the body of fog is where it is dense") {
  const Model model = model_of(field_of(hollow_box));
  ExtractOptions options = fine();
  options.threshold_per_m = 5.0;
  const Extraction shell = extract(model, options);
  // Outer less inner box: 72 − 5.2 × 2.6 × 3.2 = 28.7 m³; a field's inside stays empty.
  CHECK(volume_m3(shell) == Approx(28.7).epsilon(0.15));
  CHECK(!shell.floor_m);
  CHECK(shell.part_outside == 0.0);
  CHECK(shell.threshold_per_m == 5.0);

  SECTION("thin fog around it does not count") {
    const auto fogged = [](const glm::dvec3& p) {
      if (p.y > 3.0 && p.y < 3.5 && std::abs(p.x) < 3.0 && std::abs(p.z) < 2.0) return Matter{0.02};
      return hollow_box(p);
    };
    options.threshold_per_m.reset();
    const Extraction found = extract(model_of(field_of(fogged)), options);
    CHECK(found.threshold_per_m > 0.02 / (2.0 * kVoxel_m));
    CHECK(found.threshold_per_m < 5.0 / (2.0 * kVoxel_m));
    CHECK(box_m(found.mesh).max.y < 3.2);
  }
  SECTION("above the ground") {
    options.ground_height_m = 1.0;
    const Extraction above = extract(model, options);
    CHECK(above.floor_m == above.bottom_m);
    CHECK(box_m(above.mesh).min.y == Approx(1.0).margin(0.02));
  }
  SECTION("anywhere in the world") {
    const Model far = model_of(field_of(hollow_box), {500e3, 120.0, 4.2e6});
    const Extraction moved = extract(far, options);
    CHECK(volume_m3(moved) == Approx(volume_m3(shell)).epsilon(1e-3));
    CHECK(moved.bottom_m == Approx(120.0 + shell.bottom_m));
  }
  SECTION("whatever the number of threads") {
    const ThreadLimit one(1);
    const Extraction again = extract(model, options);
    CHECK((again.mesh.vertices_m == shell.mesh.vertices_m));
    CHECK((again.mesh.triangles == shell.mesh.triangles));
  }
}

TEST_CASE("the learned lattice is taken as it is") {
  const Model model = model_of(field_of(hollow_box));
  const auto& field = dynamic_cast<const GridField&>(*model.field);
  const LearnedVolume volume = native_volume(field);
  const std::vector<float> values = field.values();
  const auto copied = volume.grid.view().values;
  REQUIRE(copied.size() == values.size());
  CHECK(std::equal(values.begin(), values.end(), copied.begin()));

  ExtractOptions options;
  options.resolution = 0;
  const Extraction native = extract(model, options);
  CHECK(native.voxel_size_m == kVoxel_m);
  const Volume read = to_volume(native.volume);
  CHECK(read.longest_segment == 1.0);
  const std::uint32_t brick = read.grid.topology().find({0, 1, 0});
  REQUIRE(brick != kNoBrick);
  const glm::ivec3 wall(5, 10, 9);  // x 1.1, y 2.1, z 1.9 m: in the wall
  const std::uint32_t there = read.grid.topology().find(brick_of_voxel(wall));
  REQUIRE(there != kNoBrick);
  CHECK(read.grid.view().voxel(there, offset_in_brick(wall))[0] == Approx(5.0 / (2.0 * kVoxel_m)).epsilon(1e-6));
}

TEST_CASE("a plan says what is then done") {
  const Model model = model_of(field_of(hollow_box), {500.0, 20.0, -300.0});
  for (const int resolution : {0, 100}) {
    ExtractOptions options = fine();
    options.resolution = resolution;
    const ExtractionPlan plan = plan_extraction(model, options);
    const Extraction made = extract(model, options);
    CHECK(plan.voxel_size_m == made.voxel_size_m);
    CHECK(plan.box_m.min == made.box_m.min);
    CHECK(plan.box_m.max == made.box_m.max);
    CHECK(plan.part_outside == made.part_outside);
    const VdbSummary summary = made.volume.summary();
    REQUIRE(summary.grids.size() == plan.grids.size());
    std::uint64_t bytes = 0;
    for (const VdbGridSummary& grid : summary.grids) {
      CHECK(std::find(plan.grids.begin(), plan.grids.end(), grid.name) != plan.grids.end());
      CHECK(grid.n_active_voxels <= plan.n_voxels);
      if (grid.name != "occupancy") bytes += grid.memory_bytes;
    }
    // The grids are half of what works, and trees are more than their values.
    CHECK(static_cast<double>(bytes) < 1.2 * static_cast<double>(plan.voxel_bytes));
    CHECK(static_cast<double>(bytes) > 0.1 * static_cast<double>(plan.voxel_bytes));
  }
}

TEST_CASE("the cube is where things stand") {
  const auto under_fog = [](const glm::dvec3& p) { return p.y > 5.0 ? Matter{1e-3} : hollow_box(p); };
  const Model model = model_of(field_of(under_fog), {500.0, 20.0, -300.0});
  const Box matter_m = model.field->occupied_box_m();
  REQUIRE(matter_m.size().y > 5.0);
  ExtractOptions options = fine();
  const Box all_m = extract(model, options).box_m;
  CHECK(all_m.centre().y == Approx(20.0 + matter_m.centre().y));
  options.extent_m = 5.0;  // less than matter is high
  const Box lower_m = extract(model, options).box_m;
  CHECK(lower_m.min.y == Approx(20.0 + matter_m.min.y - 1.25));
  CHECK(lower_m.centre().x == Approx(500.0));
  CHECK(lower_m.centre().z == Approx(-300.0));
}

TEST_CASE("Otsu's threshold parts fog from matter") {
  std::vector<float> values;
  for (int n = 0; n < 1000; ++n) values.push_back(static_cast<float>(0.01 * (1.0 + 0.001 * n)));
  for (int n = 0; n < 300; ++n) values.push_back(static_cast<float>(5.0 * (1.0 + 0.001 * n)));
  const double threshold = otsu_threshold(values);
  CHECK(threshold > 0.02);
  CHECK(threshold < 5.0);
  CHECK(otsu_threshold({}) == 0.0);
  CHECK(otsu_threshold({2.0f, 2.0f}) == Approx(2.0).epsilon(1e-6));
}

TEST_CASE("what cannot be extracted is told with what would do") {
  const Model model = model_of(field_of(hollow_box));
  const auto message = [&](const ExtractOptions& options) {
    try {
      extract(model, options);
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  ExtractOptions options = fine();
  options.threshold_per_m = 1000.0;
  CHECK(message(options).find("12.5") != std::string::npos);  // 5 / (2 × 0.2 m)
  options = fine();
  options.centre_m = glm::dvec3(100.0, 0.0, 0.0);
  CHECK(message(options).find("--extent") != std::string::npos);
  // Voxels as large as a mountain, and grounds above it and far below.
  options = fine();
  options.extent_m = 1e9;
  CHECK(message(options).find("--extent: 1e+09 m in 100 voxels") != std::string::npos);
  CHECK(message(options).find("longer") == std::string::npos);
  options = fine();
  for (const double ground_m : {1e6, 3.5, -1e6, -20.0}) {
    options.ground_height_m = ground_m;
    const std::string told = message(options);
    CHECK(told.find(ground_m > 0.0 ? "above all that was learned, which spans heights of -6 to 3" : "below the scene") !=
          std::string::npos);
  }
  for (const double ground_m : {2.9, -0.5}) {  // within what was learned, or a little below
    options.ground_height_m = ground_m;
    CHECK(message(options) == "nothing");
  }
  options = fine();
  options.max_memory_bytes = 1000;
  CHECK(message(options).find("--max-memory") != std::string::npos);
  const Model empty = model_of(field_of([](const glm::dvec3&) { return Matter{}; }));
  CHECK_THROWS_AS(extract(empty, fine()), UsageError);
  CHECK_THROWS_AS(plan_extraction(empty, fine()), UsageError);
}
