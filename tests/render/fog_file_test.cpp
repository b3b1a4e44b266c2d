// SPDX-License-Identifier: Apache-2.0
// From a file that OpenVDB wrote to an image: a ball of constant fog against its integral.
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "catch.h"
#include "sarnerf/scene/vdb_scene.h"
#include "scratch_folder.h"
#include "vdb/vdb_grids.h"
#include "voxel_scenes.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kRadius_m = 3.0, kVoxel_m = kRadius_m / 60.0;

/// Density 1 inside, the part of a voxel that is inside at the surface, 0 outside; interiors are tiles.
void write_ball(const std::filesystem::path& path, const glm::dvec3& centre_m) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(kVoxel_m));
  auto values = grid->getAccessor();
  const glm::ivec3 middle(glm::round(centre_m / kVoxel_m));
  constexpr int kReach = 62;
  for (int x = -kReach; x <= kReach; ++x) {
    for (int y = -kReach; y <= kReach; ++y) {
      for (int z = -kReach; z <= kReach; ++z) {
        const glm::ivec3 at = middle + glm::ivec3(x, y, z);
        const double outside = glm::length(kVoxel_m * glm::dvec3(at) - centre_m) - kRadius_m;
        const double part = std::clamp(0.5 - outside / kVoxel_m, 0.0, 1.0);
        if (part > 0.0) values.setValue({at.x, at.y, at.z}, static_cast<float>(part));
      }
    }
  }
  openvdb::tools::prune(grid->tree());
  openvdb::io::File file(path.string());
  file.write(openvdb::GridPtrVec{grid});
  file.close();
}

}  // namespace

TEST_CASE("a ball of fog from OpenVDB's own file returns its analytic integral", "[voxel]") {
  const ScratchFolder folder;
  const glm::dvec3 centre_m(1.0, 5.0, -2.0);
  write_ball(folder / "ball.vdb", centre_m);
  for (const double extinction_per_m : {1e-4, 0.1}) {
    VdbReadOptions options;
    options.extinction_per_density = extinction_per_m;
    options.albedo = 0.5;
    const Scene scene = empty_scene(matte());
    const VoxelEngine engine(scene, to_volume(read_vdb(folder / "ball.vdb", options)));
    Acquisition view = view_of(35.0, 1e5, 48, 48, 0.2, 25.0);
    view.aim_m = centre_m;
    const Image<float> image = engine.render(engine.plan(view, {})).beta0;

    // A ray of chord L returns P (1 − e^(−2κL)) / (2κ); rays at distance b have L = 2 √(R² − b²). Over the
    // disc, with u = √(R² − b²): P/(2κ) (π R² − ∫ 2π u e^(−4κu) du), which is P 4/3 π R³ for κ → 0.
    const double two_way = 2.0 * extinction_per_m, scattering = 0.5 * extinction_per_m;
    const auto of_chord = [&](double length_m) { return scattering * -std::expm1(-two_way * length_m) / two_way; };
    double total = 0.0;
    for (const float p : image.pixels()) total += double(p) * view.azimuth_spacing_m * view.range_spacing_m;
    const double a = 2.0 * two_way, r = kRadius_m;
    const double lost = 2.0 * std::numbers::pi * (1.0 - std::exp(-a * r) * (1.0 + a * r)) / (a * a);
    const double thin = scattering * 4.0 / 3.0 * std::numbers::pi * r * r * r;
    const double expected = extinction_per_m < 1e-3 ? thin : scattering / two_way * (std::numbers::pi * r * r - lost);
    INFO("extinction " << extinction_per_m);
    CHECK(total == Approx(expected).epsilon(0.01));

    // Each row is the integral over its chords, averaged over its width.
    for (int i = 0; i < view.n_azimuth; ++i) {
      double row = 0.0, integral = 0.0;
      for (int j = 0; j < view.n_range; ++j) row += double(image(i, j)) * view.range_spacing_m;
      constexpr int kSteps = 400, kSlices = 21;
      for (int s = 0; s < kSlices; ++s) {
        const double along_m = view.row_offset_m(i + (s + 0.5) / kSlices - 0.5);
        const double half_m = std::sqrt(std::max(0.0, r * r - along_m * along_m));
        for (int n = 0; n < kSteps; ++n) {
          const double across_m = half_m * (2.0 * (n + 0.5) / kSteps - 1.0);
          const double u = std::sqrt(std::max(0.0, half_m * half_m - across_m * across_m));
          integral += of_chord(2.0 * u) * 2.0 * half_m / (kSteps * kSlices);
        }
      }
      if (std::abs(view.row_offset_m(i)) < 0.9 * r) {
        INFO("row " << i);
        CHECK(row == Approx(integral).epsilon(0.01));
      }
    }
  }
}

TEST_CASE("rays marched in parts, for memory, give the image of rays marched at once", "[voxel]") {
  const ScratchFolder folder;
  write_ball(folder / "ball.vdb", glm::dvec3(0.0));
  VdbReadOptions options;
  options.extinction_per_density = 0.1;
  Scene scene = empty_scene(matte());
  scene.ground = Ground{0, -3.5};
  const VoxelEngine engine(scene, to_volume(read_vdb(folder / "ball.vdb", options)));
  Acquisition view = view_of(35.0, 1e5, 2, 64, 0.2);
  view.aim_m.y = 0.0;
  // 4,000 rays of up to 240 segments in each of four slices: four times what a worker holds.
  const ViewPlan in_parts = engine.plan(view, {4000, 4});
  ViewPlan at_once = in_parts;
  request_layers(at_once, {layers_from_text("other"), 0.0});  // layers need all segments of a slice
  const RenderedView a = engine.render(in_parts), b = engine.render(at_once);
  CHECK(a.n_hits == b.n_hits);
  CHECK(relative_l2(a.beta0, b.beta0) < 1e-7);
  CHECK(a.n_hits > 10'000);
}
