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

TEST_CASE("a body is filled behind the surfaces that are seen") {
  const Model model = model_of(field_of(hollow_box));
  ExtractOptions options = fine();
  options.ground_height_m = 0.0;
  const Extraction solid = extract(model, options);
  // The surface lies within the outer voxel: 0.1 m at most too far in or out, of walls 6 × 4 × 3 m.
  CHECK(volume_m3(solid) == Approx(72.0).epsilon(0.05));
  CHECK(solid.bottom_was_given);
  CHECK(solid.part_outside == 0.0);

  SECTION("its bottom is found where returns end") {
    options.ground_height_m.reset();
    const Extraction found = extract(model, options);
    CHECK(std::abs(found.bottom_m) < 1.5 * kVoxel_m);
    CHECK(volume_m3(found) == Approx(72.0).epsilon(0.1));
  }
  SECTION("a shell is not") {
    options.body = Body::shell;
    options.threshold_per_m = 5.0;
    // Outer less inner box: 72 − 5.2 × 2.6 × 3.2 = 28.7 m³.
    CHECK(volume_m3(extract(model, options)) == Approx(28.7).epsilon(0.15));
  }
  SECTION("anywhere in the world") {
    const Model far = model_of(field_of(hollow_box), {500e3, 120.0, 4.2e6});
    options.ground_height_m = 120.0;
    const Extraction moved = extract(far, options);
    CHECK(volume_m3(moved) == Approx(volume_m3(solid)).epsilon(1e-3));
    CHECK(moved.bottom_m == 120.0);
  }
  SECTION("whatever the number of threads") {
    const ThreadLimit one(1);
    const Extraction again = extract(model, options);
    CHECK((again.mesh.vertices_m == solid.mesh.vertices_m));
    CHECK((again.mesh.triangles == solid.mesh.triangles));
  }
}

TEST_CASE("what no view sees into and no seen surface bounds is not filled") {
  // A slab on four blocks, which nobody sees between.
  const auto slab = [](const glm::dvec3& p) {
    return p.y > 1.0 && p.y < 2.0 && std::abs(p.x) < 3.0 && std::abs(p.z) < 2.0;
  };
  const auto block = [](const glm::dvec3& p) {
    return p.y > 0.0 && p.y < 1.0 && std::abs(p.x) > 2.2 && std::abs(p.x) < 3.0 && std::abs(p.z) > 1.2 && std::abs(p.z) < 2.0;
  };
  ExtractOptions options = fine();
  options.ground_height_m = 0.0;

  SECTION("between the legs of a table") {
    const auto table = [&](const glm::dvec3& p) { return Matter{slab(p) || block(p) ? 5.0 : 0.0}; };
    // 24 m³ and 4 × 0.64 m³; full down to the ground it would be 48 m³, less the 45° that views look under it.
    const double volume = volume_m3(extract(model_of(field_of(table)), options));
    CHECK(volume == Approx(26.6).epsilon(0.15));
  }
  SECTION("but a slab that stands on what nobody sees keeps it") {
    const auto alone = [&](const glm::dvec3& p) { return Matter{slab(p) ? 5.0 : 0.0}; };
    CHECK(volume_m3(extract(model_of(field_of(alone)), options)) > 32.0);
  }
  SECTION("a wall that no view has returns from is one where the others are seen") {
    const auto dark = [](const glm::dvec3& p) {
      Matter m = hollow_box(p);
      if (p.x > 2.6) m.brightness = 1e-4;
      return m;
    };
    const double dark_m3 = volume_m3(extract(model_of(field_of(dark)), options));
    CHECK(dark_m3 == Approx(72.0).epsilon(0.1));
  }
}

TEST_CASE("half of a ray's return says where the surface is and not its first fog") {
  // Dark fog of half a metre over the roof, which stops a good part of each ray and returns next to nothing.
  const auto fogged = [](const glm::dvec3& p) {
    if (p.y > 3.0 && p.y < 3.5 && std::abs(p.x) < 3.0 && std::abs(p.z) < 2.0) return Matter{0.2, 0.001};
    return hollow_box(p);
  };
  ExtractOptions options = fine();
  options.ground_height_m = 0.0;
  const double clear_m3 = volume_m3(extract(model_of(field_of(hollow_box)), options));
  CHECK(volume_m3(extract(model_of(field_of(fogged)), options)) == Approx(clear_m3).epsilon(0.02));
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
    for (const Body body : {Body::solid, Body::shell}) {
      ExtractOptions options = fine();
      options.resolution = resolution;
      options.body = body;
      const ExtractionPlan plan = plan_extraction(model, options);
      const Extraction made = extract(model, options);
      CHECK(plan.voxel_size_m == made.voxel_size_m);
      CHECK(plan.box_m.min == made.box_m.min);
      CHECK(plan.box_m.max == made.box_m.max);
      CHECK(plan.part_outside == made.part_outside);
      CHECK(plan.n_views == (body == Body::solid ? 54 : 0));
      const VdbSummary summary = made.volume.summary();
      REQUIRE(summary.grids.size() == plan.grids.size());
      std::uint64_t bytes = 0;
      for (const VdbGridSummary& grid : summary.grids) {
        CHECK(std::find(plan.grids.begin(), plan.grids.end(), grid.name) != plan.grids.end());
        if (grid.name == "occupancy") continue;
        CHECK(grid.n_active_voxels <= plan.n_voxels);
        bytes += grid.memory_bytes;
      }
      // The grids are half of what works, and trees are more than their values.
      CHECK(static_cast<double>(bytes) < 1.2 * static_cast<double>(plan.voxel_bytes));
      CHECK(static_cast<double>(bytes) > 0.1 * static_cast<double>(plan.voxel_bytes));
    }
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

TEST_CASE("what views see counts as memory, in proportion to the rays") {
  const std::vector<Acquisition> one(1, acquisition_of(model_of(nullptr).info.training_views.front(), glm::dvec3(0.0)));
  const std::vector<Acquisition> ten(10, one.front());
  const Box box_m{glm::dvec3(-5.0, 0.0, -4.0), glm::dvec3(5.0, 6.0, 4.0)};
  // From azimuth 0 at 35° the box is 10 m along track and 8 cos 35° + 6 sin 35° = 10 m across: 100 × 100 rays of 0.1 m.
  const auto bytes = static_cast<double>(return_map_bytes(one, box_m, 0.1));
  CHECK(bytes >= 12.0 * 100 * 100);
  CHECK(bytes < 30.0 * 104 * 104);
  CHECK(static_cast<double>(return_map_bytes(ten, box_m, 0.1)) == Approx(10.0 * bytes).epsilon(1e-3));
  CHECK(static_cast<double>(return_map_bytes(one, box_m, 0.01)) == Approx(100.0 * bytes).epsilon(0.1));
  CHECK(memory_beside_maps(ten, box_m, 0.1, 0) == 0);
  CHECK(memory_beside_maps(ten, box_m, 0.1, 1 << 30) == (1 << 30) - return_map_bytes(ten, box_m, 0.1));
  CHECK_THROWS_AS(memory_beside_maps(ten, box_m, 0.1, return_map_bytes(ten, box_m, 0.1)), UsageError);
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
  // 54 views of a field of 10 × 6 × 8 m and rays 0.13 m apart need far more than a shell's voxels of half a metre.
  options = fine();
  options.resolution = 20;
  options.max_memory_bytes = 3 << 20;
  CHECK(message(options).find("--shell") != std::string::npos);
  options.body = Body::shell;
  CHECK(message(options) == "nothing");
  const Model empty = model_of(field_of([](const glm::dvec3&) { return Matter{}; }));
  CHECK_THROWS_AS(extract(empty, fine()), UsageError);
  CHECK_THROWS_AS(plan_extraction(empty, fine()), UsageError);
}
