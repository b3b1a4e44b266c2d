// SPDX-License-Identifier: Apache-2.0
// The field `mlp` as voxels.
#include <algorithm>
#include <cmath>

#include "../nerf/torch_catch.h"
#include "learned_volume.h"
#include "sarnerf/bake/extract.h"
#include "sarnerf/core/error.h"
#include "sarnerf/field/field_sampler.h"
#include "sarnerf/nerf/mlp_field.h"
#include "sarnerf/nerf/model_file.h"

using namespace sarnerf;

namespace {

const MlpShape kShape{3, 64, 1, 2, 2};
const Box kBox{glm::dvec3(-2.0), glm::dvec3(2.0)};

/// Matter that comes and goes within ±2 m, brighter here and darker there, from all sides alike or not.
MlpField field_of(bool turns, double extinction_scale = 12.0) {
  MlpNetwork network = make_mlp_network(kShape, kBox, 7);
  {
    const torch::NoGradGuard no_gradients;
    for (const MlpLayer& layer : mlp_layers(kShape)) {
      if (layer.name == "sigma") network.weight(layer).mul_(extinction_scale);
      if (layer.name == "s") network.weight(layer).mul_(8.0);
      // What follows the bottleneck's output is the encoded direction.
      if (layer.name == "direction" && !turns)
        network.weight(layer).narrow(1, kShape.width, layer.n_in - kShape.width).zero_();
    }
  }
  CarvedVoxels voxels;
  for (int x = -1; x < 1; ++x)
    for (int y = -1; y < 1; ++y)
      for (int z = -1; z < 1; ++z) voxels.topology.insert({x, y, z});
  voxels.active.assign(8 * kBrickVoxels, 1);
  const double voxel_m = 0.25;
  MlpField field(std::move(network), {0.3, 2.0, Integrator::exact}, {glm::dvec3(0.5 * voxel_m), voxel_m}, std::move(voxels));
  field.refresh(-1.0);
  return field;
}

std::vector<DatasetView> dataset_views() {
  std::vector<DatasetView> views;
  for (const double incidence_deg : {30.0, 50.0})
    for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30) {
      DatasetView view;
      view.azimuth_deg = azimuth_deg;
      view.incidence_deg = incidence_deg;
      view.slant_range_m = 5000.0;
      view.n_azimuth = view.n_range = 32;
      view.azimuth_spacing_m = view.range_spacing_m = 0.3;
      views.push_back(view);
    }
  return views;
}

std::vector<Acquisition> views() {
  std::vector<Acquisition> result;
  for (const DatasetView& view : dataset_views()) result.push_back(acquisition_of(view, glm::dvec3(0.0)));
  return result;
}

/// The network itself at points seen along one direction: κ and brightness.
std::vector<glm::dvec2> evaluated(const MlpField& field, std::span<const glm::vec3> points_m, const glm::dvec3& direction) {
  const torch::NoGradGuard no_gradients;
  const glm::vec3 towards(direction);
  const std::uint32_t ray_begin[] = {0, static_cast<std::uint32_t>(points_m.size())};
  const auto values = field.evaluate(points_m, {&towards, 1}, ray_begin);
  std::vector<glm::dvec2> result;
  for (std::size_t n = 0; n < points_m.size(); ++n)
    result.emplace_back(values.extinction_per_m.data_ptr<float>()[n], values.brightness.data_ptr<float>()[n]);
  return result;
}

VoxelLattice lattice_of() {
  VoxelLattice lattice;
  lattice.transform = {glm::dvec3(0.03, -0.05, 0.01), 0.19};
  lattice.first = glm::ivec3(-9), lattice.last = glm::ivec3(9);
  return lattice;
}

struct Comparison {
  std::size_t n_matter = 0, n_empty = 0;
  double extinction = 0.0;  ///< largest relative difference
  double brightness = 0.0;  ///< root of the mean square difference, relative, weighted by extinction
};

/// At every voxel of the lattice, towards all views.
Comparison compared(const MlpField& field, const LearnedVolume& volume, const VoxelLattice& lattice) {
  std::vector<glm::ivec3> voxels;
  std::vector<glm::vec3> points_m;
  for (int x = lattice.first.x; x <= lattice.last.x; ++x)
    for (int y = lattice.first.y; y <= lattice.last.y; ++y)
      for (int z = lattice.first.z; z <= lattice.last.z; ++z) {
        voxels.emplace_back(x, y, z);
        points_m.emplace_back(lattice.transform.world_from_index(glm::dvec3(x, y, z)));
      }
  const double least = 0.01 / (2.0 * field.units().reference_bin_m);
  Comparison c;
  double square = 0.0, difference = 0.0;
  for (const Acquisition& view : views()) {
    const glm::dvec3 direction = radar_frame(view).k;
    const auto y_lm = spherical_harmonics(direction, 2);
    const std::vector<glm::dvec2> truth = evaluated(field, points_m, direction);
    c.n_matter = c.n_empty = 0;
    bool empty_is_empty = true, matter_is_there = true;
    for (std::size_t n = 0; n < voxels.size(); ++n) {
      const std::uint32_t brick = volume.grid.topology().find(brick_of_voxel(voxels[n]));
      const float* const value =
          brick == kNoBrick ? nullptr : volume.grid.view().voxel(brick, offset_in_brick(voxels[n]));
      if (truth[n].x < least) {
        ++c.n_empty;
        empty_is_empty = empty_is_empty && (value == nullptr || (value[0] == 0.0f && value[1] == 0.0f));
        continue;
      }
      ++c.n_matter;
      matter_is_there = matter_is_there && value != nullptr;
      if (value == nullptr) continue;
      c.extinction = worse(c.extinction, std::abs(double{value[0]} - truth[n].x) / truth[n].x);
      double fitted = 0.0;
      for (std::size_t l = 0; l < 9; ++l) fitted += y_lm[l] * double{value[1 + l]};
      square += truth[n].x * truth[n].y * truth[n].y;
      difference += truth[n].x * (fitted - truth[n].y) * (fitted - truth[n].y);
    }
    CHECK(empty_is_empty);
    CHECK(matter_is_there);
  }
  c.brightness = std::sqrt(difference / square);
  return c;
}

}  // namespace

TEST_CASE("a network whose brightness does not turn is its voxels", "[mlp_volume]") {
  const MlpField field = field_of(false);
  const VoxelLattice lattice = lattice_of();
  const LearnedVolume volume = sampled(field, lattice, views(), 0, {});
  CHECK(volume.channels.harmonics_degree == 2);
  const Comparison c = compared(field, volume, lattice);
  CHECK(c.n_matter > 500);
  CHECK(c.n_empty > 500);
  CHECK(c.extinction < 0.01);  // kernels of bf16 numbers, in batches and one by one
  // What is left is the little that keeps the fit's equations solvable.
  CHECK(c.brightness < 0.01);
  CHECK(volume.harmonics_residual < 0.01);
}

TEST_CASE("brightness that turns is fitted, and how far it is not is told", "[mlp_volume]") {
  const MlpField field = field_of(true);
  const VoxelLattice lattice = lattice_of();
  const LearnedVolume volume = sampled(field, lattice, views(), 0, {});
  const Comparison c = compared(field, volume, lattice);
  CHECK(volume.harmonics_residual > 0.02);
  CHECK(volume.harmonics_residual < 1.0);
  // Told of 12 of the directions, which the fit was made for; here of all 24.
  CHECK(c.brightness >= 0.9 * volume.harmonics_residual);
  CHECK(c.brightness < 4.0 * volume.harmonics_residual);
}

TEST_CASE("a volume of a network keeps to its memory and says how good its harmonics are", "[mlp_volume]") {
  Model model;
  model.info.program = "test";
  model.info.scene_box_m = kBox;
  model.info.aim_m = {100.0, 5.0, -20.0};
  model.info.training_views = dataset_views();
  model.field = std::make_unique<MlpField>(field_of(true));
  ExtractOptions options;
  options.resolution = 24;
  options.extent_m = 4.8;
  const ExtractionPlan plan = plan_extraction(model, options);
  CHECK(plan.grids.size() == 11);
  CHECK(plan.voxel_size_m == Approx(0.2));
  const Extraction x = extract(model, options);
  CHECK(x.harmonics_residual > 0.0);
  const VdbSummary summary = x.volume.summary();
  std::string residual, kind;
  for (const auto& [name, value] : summary.metadata) {
    if (name == "harmonics_residual") residual = value;
    if (name == "field") kind = value;
  }
  CHECK(kind == "mlp");
  REQUIRE_FALSE(residual.empty());
  CHECK(std::stod(residual) == Approx(x.harmonics_residual).epsilon(1e-3));
  REQUIRE(summary.grids.size() == plan.grids.size());
  for (const VdbGridSummary& grid : summary.grids) {
    CHECK(std::find(plan.grids.begin(), plan.grids.end(), grid.name) != plan.grids.end());
    CHECK(grid.n_active_voxels <= plan.n_voxels);
  }
  options.max_memory_bytes = plan.voxel_bytes / 2;
  CHECK_THROWS_AS(extract(model, options), UsageError);
  model.field = std::make_unique<MlpField>(field_of(true, 0.0));  // occupied for all that the lattice knows, and empty
  options.max_memory_bytes = 0;
  try {
    extract(model, options);
    FAIL("a model without matter was extracted");
  } catch (const UsageError& error) {
    CHECK(std::string(error.what()).find("no matter at all") != std::string::npos);
  }
}
