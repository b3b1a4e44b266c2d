// SPDX-License-Identifier: Apache-2.0
// Simulation and learning share one sampling core: the voxel engine and the learned fields make the same row of the same
// numbers.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "../nerf/small_grid.h"
#include "../nerf/small_mlp.h"
#include "../nerf/torch_catch.h"
#include "sarnerf/mpa/azimuth_rows.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/vdb_scene.h"

using namespace sarnerf;

namespace {

constexpr int kSlices = 3;

/// The numbers of a learned grid as a volume; the world's origin is where the field's frame has it.
Volume volume_of(const GridField& field) {
  Volume volume;
  volume.channels = field.channels();
  const std::vector<float> values = field.values();
  const BrickView<const float> from = field.view(values);
  volume.grid = BrickGrid<float>(field.transform(), from.n_channels);
  for (std::uint32_t b = 0; b < from.topology->n_bricks(); ++b) {
    const std::uint32_t to = volume.grid.touch_brick(from.topology->coordinate(b));
    std::copy_n(from.voxel(b, 0), std::size_t{kBrickVoxels} * static_cast<std::size_t>(from.n_channels),
                volume.grid.view().voxel(to, 0));
  }
  volume.n_occupied_voxels = field.n_active();
  volume.box_m = volume.support_m = field.occupied_box_m();
  volume.longest_segment = 1.0;
  return volume;
}

/// The plan of the voxel engine for a view, with the slices of these tests.
ViewPlan plan_of(const VoxelEngine& engine, const Acquisition& view, int n_elevation) {
  Sampling sampling;
  sampling.n_elevation = n_elevation;
  sampling.n_sub_rows = kSlices;
  return engine.plan(view, sampling);
}

/// All rows of a view by a learned field, along the rays of the engine's plan.
template <class Field>
Image<float> render_along(const Field& field, const ViewPlan& plan, double longest_m, Deposit deposit) {
  RaySampling sampling;
  sampling.sub_rows = plan.n_sub_rows;
  sampling.longest_m = longest_m;
  sampling.deposit = deposit;
  const Acquisition& a = plan.acquisition;
  std::vector<RowRequest> rows;
  for (int i = 0; i < a.n_azimuth; ++i) {
    RowRequest row{a, i};
    row.even = plan.fan;
    rows.push_back(row);
  }
  Image<float> image(a.n_azimuth, a.n_range);
  field.render_rows(rows, sampling, image.pixels());
  return image;
}

double largest(const Image<float>& image) { return *std::ranges::max_element(image.pixels()); }

/// Largest difference of two images, in parts of the largest pixel.
double difference(const Image<float>& a, const Image<float>& b) {
  double most = 0.0;
  for (std::size_t p = 0; p < a.pixels().size(); ++p)
    most = std::max(most, std::abs(double{a.pixels()[p]} - double{b.pixels()[p]}));
  return most / largest(b);
}

/// Root of the mean square of differences, relative to that of the second image.
double relative_l2(const Image<float>& a, const Image<float>& b) {
  double errors = 0.0, squares = 0.0;
  for (std::size_t p = 0; p < a.pixels().size(); ++p) {
    errors += std::pow(double{a.pixels()[p]} - double{b.pixels()[p]}, 2);
    squares += std::pow(double{b.pixels()[p]}, 2);
  }
  return std::sqrt(errors / squares);
}

}  // namespace

TEST_CASE("voxel engine and learned grid render the same numbers alike") {
  const GridField field = small_grid(5);
  const Volume volume = volume_of(field);
  const double voxel_m = field.transform().voxel_size_m;
  for (const double azimuth_rad : {0.3, 2.1, 4.0}) {
    Scene scene;
    scene.box = volume.box_m;
    const VoxelEngine engine(scene, volume);
    const ViewPlan plan = plan_of(engine, small_acquisition(azimuth_rad), 40);
    const Image<float> simulated = engine.render(plan).beta0;
    const Image<float> learned = render_along(field, plan, voxel_m, Deposit::over_footprint);
    CHECK(largest(simulated) > 0.0);
    CHECK(difference(learned, simulated) < 1e-6);
    // With the other deposit, the same rays and segments give another image: the deposit is what both share.
    CHECK(difference(render_along(field, plan, voxel_m, Deposit::in_bin), simulated) > 1e-3);
  }
}
