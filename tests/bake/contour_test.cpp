// SPDX-License-Identifier: Apache-2.0
// The body of the field `surface`: where its distance is below 0, and what no view sees of it.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "../nerf/torch_catch.h"
#include "sarnerf/bake/extract.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/model_file.h"
#include "sarnerf/nerf/surface_field.h"
#include "surface_checks.h"
#include "vdb/vdb_grids.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kBallVoxel_m = 0.15, kRadius_m = 1.3;

/// A model whose distance from the surface is `distance_m`, within ± 3.6 m about the aim point, seen from all around at 45°.
Model model_of(const std::function<double(const glm::dvec3&)>& distance_m, const glm::dvec3& aim_m = glm::dvec3(0.0)) {
  BrickTopology topology;
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 3; ++z) topology.insert({x, y, z});
  auto field = std::make_unique<SurfaceField>(GridTransform{glm::dvec3(0.01), kBallVoxel_m}, std::move(topology), 1.2, 1.0);
  const torch::NoGradGuard no_grad;
  float* const f = field->distance.data_ptr<float>();
  for (std::size_t v = 0; v < field->n_voxels(); ++v)
    f[v] = static_cast<float>(std::clamp(distance_m(field->transform().world_from_index(glm::dvec3(field->topology().voxel(v)))), -1.0, 1.0));
  field->log_albedo.fill_(std::log(2.0));
  field->exponent.fill_(1.5);
  field->set_sharpness(30.0);
  field->refresh();
  Model model;
  model.info.program = "test";
  model.info.aim_m = aim_m;
  model.info.scene_box_m = {aim_m - 3.0, aim_m + 3.0};
  for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 20) {
    DatasetView view;
    view.azimuth_deg = azimuth_deg;
    view.incidence_deg = 45.0;
    view.slant_range_m = 5000.0;
    view.n_azimuth = view.n_range = 64;
    view.azimuth_spacing_m = view.range_spacing_m = 0.25;
    model.info.training_views.push_back(view);
  }
  model.field = std::move(field);
  return model;
}

double ball(const glm::dvec3& p) { return glm::length(p) - kRadius_m; }

ExtractOptions cube() {
  ExtractOptions options;
  options.resolution = 96;
  options.extent_m = 6.0;
  return options;
}

}  // namespace

TEST_CASE("the body of a surface is where its distance is below 0") {
  const glm::dvec3 aim_m(300'000.0, 120.0, -40'000.0);
  const Model model = model_of(ball, aim_m);
  const int resolution = GENERATE(0, 96);
  ExtractOptions options = cube();
  options.resolution = resolution;
  options.unseen = Unseen::hull;  // also where no view sees it
  const Extraction x = extract(model, options);
  const double ball_m3 = 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius_m, 3);
  CHECK(signed_volume_m3(x.mesh) == Approx(ball_m3).epsilon(0.03));
  for (const glm::dvec3& v : x.mesh.vertices_m) REQUIRE(std::abs(ball(v - aim_m)) < 0.02);
  CHECK(edge_counts(x.mesh).open == 0);
  CHECK(x.n_components == 1);
  CHECK(x.n_unseen_components == 0);
  CHECK(x.bottom_m == Approx(aim_m.y - kRadius_m).margin(0.02));

  // From 45° the lowest cap of ± 45° is in shadow.
  REQUIRE(x.mesh.unseen.size() == x.mesh.vertices_m.size());
  for (std::size_t v = 0; v < x.mesh.unseen.size(); ++v) {
    const double height = (x.mesh.vertices_m[v].y - aim_m.y) / kRadius_m;
    if (height > -0.6) CHECK(x.mesh.unseen[v] == 0);
    if (height < -0.8) CHECK(x.mesh.unseen[v] == 1);
  }

  const VdbScene::Grids& grids = x.volume.grids();
  REQUIRE(grids.basis == SourceBasis::cosine);
  require_complete(grids);
  CHECK(grids.distance->background() == Approx(3.0 * x.voxel_size_m));
  for (auto d = grids.distance->cbeginValueOn(); d; ++d) {
    const openvdb::Vec3d p = grids.distance->indexToWorld(d.getCoord());
    const glm::dvec3 at = glm::dvec3(p.x(), p.y(), p.z()) - aim_m;
    REQUIRE(double{*d} == Approx(ball(at)).margin(0.02));
    const openvdb::Vec3s n = grids.normal->tree().getValue(d.getCoord());
    REQUIRE(glm::dot(glm::dvec3(n.x(), n.y(), n.z()), glm::normalize(at)) > 0.98);
    REQUIRE(grids.brightness.front()->tree().getValue(d.getCoord()) == Approx(2.0f).epsilon(1e-3));
    REQUIRE(grids.exponent->tree().getValue(d.getCoord()) == Approx(1.5f));
  }
  const auto centre = grids.occupancy->transform().worldToIndexCellCentered({aim_m.x, aim_m.y, aim_m.z});
  CHECK(grids.occupancy->tree().getValue(centre) == 1.0f);
  CHECK(grids.distance->tree().getValue(centre) < 0.0f);
}

TEST_CASE("what no view sees is marked, and removed where nothing of it is seen") {
  // A ball, a cavity in it, and a small ball in the shadow below it.
  const Model model = model_of([](const glm::dvec3& p) {
    const double cavity = 0.5 - glm::length(p - glm::dvec3(0.1, 0.2, 0.0)), island = glm::length(p - glm::dvec3(0.0, -1.55, 0.0)) - 0.15;
    return std::min(std::max(ball(p), cavity), island);
  });
  ExtractOptions options = cube();
  options.unseen = Unseen::hull;
  const Extraction x = extract(model, options);
  CHECK(x.n_components == 3);
  CHECK(x.n_unseen_components == 2);
  for (const glm::dvec3& v : x.mesh.vertices_m) REQUIRE(std::abs(ball(v)) < 0.02);
  CHECK(edge_counts(x.mesh).open == 0);
  CHECK(x.unseen_part > 0.05);
  CHECK(x.unseen_part < 0.25);
  CHECK(x.volume.grids().unseen->activeVoxelCount() > 1000);
}

TEST_CASE("what no view sees is closed by a membrane, unless a ground bounds it") {
  // A box, and below it the cone of its shadow, as views from 35 to 55 degrees leave it: 45 degrees is seen from no side.
  const auto cone = [](const glm::dvec3& p) {
    const glm::dvec3 q = glm::abs(p - glm::dvec3(0.0, 0.3, 0.0)) - glm::dvec3(1.0, 0.6, 1.0);
    const double box = std::max({q.x, q.y, q.z}), below = -0.3 - p.y;
    const double shadow = std::max({below - 0.6, (std::max(std::abs(p.x), std::abs(p.z)) + below - 1.0) / std::numbers::sqrt2, p.y});
    return std::min(box, shadow);
  };
  ExtractOptions options = cube();
  options.unseen = Unseen::hull;
  const double hull_m3 = signed_volume_m3(extract(model_of(cone), options).mesh);
  CHECK(hull_m3 > 1.25 * 4.8);
  options.unseen.reset();
  const Extraction closed = extract(model_of(cone), options);
  CHECK(signed_volume_m3(closed.mesh) == Approx(4.8).epsilon(0.05));
  CHECK(box_m(closed.mesh).min.y == Approx(-0.3).margin(0.1));
  CHECK(edge_counts(closed.mesh).open == 0);
  CHECK(closed.unseen_part > 0.1);
  const auto centre = closed.volume.grids().distance->transform().worldToIndexCellCentered({0.0, -0.6, 0.0});
  CHECK(closed.volume.grids().distance->tree().getValue(centre) > 0.0f);
  options.ground_height_m = -0.7;
  CHECK(box_m(extract(model_of(cone), options).mesh).min.y == Approx(-0.7).margin(0.02));
}

TEST_CASE("a ground cuts a surface off") {
  ExtractOptions options = cube();
  options.ground_height_m = -0.5;
  const Extraction x = extract(model_of(ball), options);
  CHECK(box_m(x.mesh).min.y == Approx(-0.5).margin(0.01));
  const double height = kRadius_m + 0.5, cap_m3 = std::numbers::pi * height * height * (kRadius_m - height / 3.0);
  CHECK(signed_volume_m3(x.mesh) == Approx(cap_m3).epsilon(0.03));
  CHECK(edge_counts(x.mesh).open == 0);
}

TEST_CASE("a plan of a surface names its grids, and options that a surface does not need are refused") {
  const Model model = model_of(ball);
  const ExtractionPlan plan = plan_extraction(model, cube());
  const Extraction x = extract(model, cube());
  REQUIRE(plan.grids.size() == x.volume.summary().grids.size());
  for (std::size_t n = 0; n < plan.grids.size(); ++n) CHECK(plan.grids[n] == x.volume.summary().grids[n].name);
  std::uint64_t bytes = 0;
  for (const VdbGridSummary& grid : x.volume.summary().grids) bytes += grid.memory_bytes;
  CHECK(bytes <= 2 * plan.voxel_bytes);
  ExtractOptions options = cube();
  options.max_memory_bytes = plan.voxel_bytes / 2;
  CHECK_THROWS_AS(extract(model, options), UsageError);
  options = cube();
  options.threshold_per_m = 1.0;
  CHECK_THROWS_AS(extract(model, options), UsageError);
}
