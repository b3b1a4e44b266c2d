// SPDX-License-Identifier: Apache-2.0
// Simulation and learning share one sampling core: the voxel engine and the learned fields make the same row of the same
// numbers.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
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
  sampling.n_slices = kSlices;
  return engine.plan(view, sampling);
}

/// All rows of a view by a learned field, along the rays of the engine's plan.
template <class Field>
Image<float> render_along(const Field& field, const ViewPlan& plan, double longest_m, Deposit deposit) {
  RaySampling sampling;
  sampling.sub_rows = plan.n_slices;
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
    most = worse(most, std::abs(double{a.pixels()[p]} - double{b.pixels()[p]}));
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

namespace {

/// A network's values at the places of a lattice, so many on a side of the cache's voxels; no extinction where its occupancy
/// grid is empty. Brightness is that of one direction.
Volume lattice_of(const MlpField& field, int per_voxel, const glm::dvec3& direction) {
  const Box box_m = field.occupied_box_m();
  const double spacing_m = field.voxel_size_m() / per_voxel;
  const GridTransform transform{box_m.min, spacing_m};  // a corner of a cell of the cache
  const Occupancy& occupancy = field.cache().occupancy();
  const auto in_occupied_cell = [&](const glm::dvec3& at_m) {
    const glm::ivec3 cell(glm::floor(field.cache().transform().index_from_world(at_m)));
    const std::uint32_t brick = occupancy.bricks().find(brick_of_voxel(cell));
    return brick != kNoBrick && occupancy.cell(brick, cell);
  };
  std::vector<glm::ivec3> voxels;
  std::vector<glm::vec3> points_m;
  std::vector<bool> occupied;
  const glm::ivec3 n(glm::ceil(box_m.size() / spacing_m));
  for (int x = -1; x <= n.x + 1; ++x)
    for (int y = -1; y <= n.y + 1; ++y)
      for (int z = -1; z <= n.z + 1; ++z) {
        const glm::dvec3 at_m = transform.world_from_index(glm::dvec3(x, y, z));
        bool any = false;  // of the cells that meet here
        for (int c = 0; c < 8; ++c) {
          const glm::dvec3 aside(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
          any = any || in_occupied_cell(at_m + 1e-3 * spacing_m * aside);
        }
        occupied.push_back(any);
        voxels.push_back({x, y, z});
        points_m.emplace_back(at_m);
      }
  const torch::NoGradGuard no_grad;
  const std::vector<glm::vec3> directions{glm::vec3(direction)};
  const std::vector<std::uint32_t> one_ray{0, static_cast<std::uint32_t>(points_m.size())};
  const MlpField::Values values = field.evaluate(points_m, directions, one_ray);
  const float* const kappa = values.extinction_per_m.data_ptr<float>();
  const torch::Tensor brightness = values.brightness.contiguous();
  const float* const gamma = brightness.data_ptr<float>();
  const auto constant = static_cast<float>(1.0 / spherical_harmonics(direction, 0)[0]);

  Volume volume;
  volume.channels = {false, 0, SourceBasis::harmonics};
  volume.grid = BrickGrid<float>(transform, volume.channels.count());
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    const auto voxel = volume.grid.touch_voxel(voxels[v]);
    voxel[0] = occupied[v] ? kappa[v] : 0.0f;
    voxel[1] = gamma[v] * constant;
    volume.n_occupied_voxels += voxel[0] > 0.0f;
  }
  volume.box_m = box_m;
  volume.support_m = {box_m.min - spacing_m, box_m.max + spacing_m};
  return volume;
}

}  // namespace

TEST_CASE("voxel engine renders a network's lattice as the network renders itself, to the lattice's error") {
  constexpr double kLongest_m = 0.05;
  const MlpField field = small_mlp(3);
  Acquisition view = small_acquisition(0.9);
  view.slant_range_m = 2e4;  // all rays come from one direction
  std::vector<Image<float>> images;
  std::vector<double> errors;
  std::optional<ViewPlan> plan;
  Image<float> truth;
  for (const int per_voxel : {2, 4, 8}) {
    Volume volume = lattice_of(field, per_voxel, radar_frame(view).k);
    volume.longest_segment = kLongest_m * per_voxel / field.voxel_size_m();
    Scene scene;
    scene.box = volume.box_m;
    const VoxelEngine engine(scene, std::move(volume));
    if (!plan) {
      plan = plan_of(engine, view, 60);
      truth = render_along(field, *plan, kLongest_m, Deposit::over_footprint);
    }
    images.push_back(engine.render(*plan).beta0);
    errors.push_back(relative_l2(images.back(), truth));
  }
  // The network's ReLU and the border of what the cache counts as occupied are creases: the error is of first order, and
  // what is left of it when it is extrapolated to no spacing is none of the core's.
  INFO(errors[0] << " " << errors[1] << " " << errors[2]);
  CHECK(largest(truth) > 0.0);
  CHECK(errors[1] < 0.6 * errors[0]);
  CHECK(errors[2] < 0.6 * errors[1]);
  Image<float> extrapolated = images[2];
  for (std::size_t p = 0; p < extrapolated.pixels().size(); ++p)
    extrapolated.pixels()[p] = 2.0f * images[2].pixels()[p] - images[1].pixels()[p];
  CHECK(relative_l2(extrapolated, truth) < 0.02);
}
