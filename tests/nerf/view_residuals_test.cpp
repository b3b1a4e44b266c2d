// SPDX-License-Identifier: Apache-2.0
// What views show beyond a field: kriging weights in closed form, covariance found again, nothing where there is nothing.
#include "sarnerf/nerf/view_residuals.h"

#include <cmath>
#include <random>

#include "ground_scene.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/returned_share.h"
#include "small_grid.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

constexpr double kDegree = 0.017453292519943295;

/// Views around the scene; `pattern(azimuth, pixel)` is what their residuals hold.
template <class Pattern>
ViewResiduals residuals_of_views(int n_views, Pattern&& pattern) {
  ViewResiduals residuals;
  for (int v = 0; v < n_views; ++v) {
    Acquisition a = small_acquisition(2.0 * 3.14159265358979 * v / n_views);
    Image<float> image(a.n_azimuth, a.n_range);
    for (std::size_t n = 0; n < image.pixels().size(); ++n) image.pixels()[n] = pattern(v, n);
    residuals.views.push_back({"view", a, std::move(image)});
  }
  residuals.share = residuals.target_share = 0.5;
  residuals.length_rad = 10.0 * kDegree;
  residuals.ground_power = 0.5;
  return residuals;
}

/// An opaque level ground of power 1 without matter above it.
TrainingSet bare_set(int n_views, bool common, GridField& field) {
  TrainingSet set;
  auto ground = std::make_shared<LevelGround>();
  ground->height_m = -2.0;
  ground->texture = Image<float>(3, 3, 1.0f);
  ground->first_x_m = ground->first_z_m = -1.0;
  ground->incidence_rad = {0.8};
  ground->gain = {1.0};
  field.ground = ground;
  field.log_depth.requires_grad_(false).fill_(-30.0f);
  std::mt19937 random(3);
  std::exponential_distribution<float> speckle(1.0f);
  for (int v = 0; v < n_views; ++v) {
    Acquisition a = small_acquisition(0.2 * kDegree * v);
    Image<float> image(a.n_azimuth, a.n_range);
    if (common) random.seed(3);  // the same speckle in all of them, which hardly turn
    for (float& p : image.pixels()) p = speckle(random);
    set.images.push_back({"view", a, std::move(image)});
  }
  set.clutter.emplace();
  set.clutter->ground = ground;
  return set;
}

/// Makes the field of a bare_set() shine over a ground that hardly does.
void let_shine(GridField& field, TrainingSet& set) {
  field.log_depth.fill_(0.0f);
  auto dim = std::make_shared<LevelGround>(*field.ground);
  dim->texture = Image<float>(3, 3, 1e-3f);
  field.ground = set.clutter->ground = dim;
}

}  // namespace

TEST_CASE("one neighbour weighs as much as it is alike") {
  const ViewResiduals residuals = residuals_of_views(12, [](int, std::size_t) { return 0.0f; });
  const std::size_t first[] = {0};
  CHECK(residuals.weights(first, small_acquisition(0.0), 0.5)[0] == Approx(0.5));
  // Azimuths 30° apart are lines of sight less than that apart.
  const double angle = std::acos(glm::dot(radar_frame(small_acquisition(0.0)).k, radar_frame(residuals.views[1].acquisition).k));
  const std::size_t second[] = {1};
  CHECK(residuals.weights(second, small_acquisition(0.0), 0.5)[0] == Approx(0.5 * std::exp(-angle / residuals.length_rad)));
}

TEST_CASE("weights solve the equations of simple kriging") {
  const ViewResiduals residuals = residuals_of_views(72, [](int, std::size_t) { return 0.0f; });
  const std::size_t near[] = {0, 1, 2, 71};
  const Acquisition wanted = small_acquisition(0.04);
  const std::vector<double> w = residuals.weights(near, wanted, 0.5);
  const auto covariance = [&](const Acquisition& a, const Acquisition& b) {
    return 0.5 * std::exp(-std::acos(std::min(1.0, glm::dot(radar_frame(a).k, radar_frame(b).k))) / residuals.length_rad);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const Acquisition& own = residuals.views[near[i]].acquisition;
    double left = w[i];
    for (std::size_t j = 0; j < 4; ++j)
      if (j != i) left += covariance(own, residuals.views[near[j]].acquisition) * w[j];
    CHECK(left == Approx(covariance(own, wanted)).epsilon(1e-9));
  }
}

TEST_CASE("what neighbours share is added to a view and never leaves it below zero") {
  const ViewResiduals brighter = residuals_of_views(72, [](int, std::size_t) { return 0.5f; });
  const Acquisition wanted = small_acquisition(0.04);
  Image<float> image(wanted.n_azimuth, wanted.n_range, 2.0f);
  brighter.correct(image, wanted);
  const std::size_t near[] = {0, 1, 71, 2, 70, 3};
  double sum = 0.0;
  for (const double w : brighter.weights(near, wanted, 0.5)) sum += w;
  CHECK(image(wanted.n_azimuth / 2, wanted.n_range / 2) == Approx(2.1 * std::pow(1.0 + 0.5 * sum, 2) - 0.1).epsilon(1e-3));

  ViewResiduals darker = residuals_of_views(72, [](int, std::size_t) { return -4.0f; });
  darker.correct(image, wanted);
  for (const float p : image.pixels()) CHECK_FALSE(p < 0.0f);
}

TEST_CASE("what shines has a share of its own") {
  ViewResiduals residuals = residuals_of_views(72, [](int, std::size_t) { return 0.5f; });
  residuals.share = 0.0;
  const Acquisition wanted = small_acquisition(0.04);
  Image<float> ground(wanted.n_azimuth, wanted.n_range, 0.9f), target(wanted.n_azimuth, wanted.n_range, 2.1f);
  residuals.correct(ground, wanted);
  residuals.correct(target, wanted);
  const int i = wanted.n_azimuth / 2, j = wanted.n_range / 2;
  CHECK(ground(i, j) == Approx(0.9));
  CHECK(target(i, j) > 2.5);
}

TEST_CASE("independent speckle leaves nothing to add and speckle in common does") {
  GridField field = small_grid(31);
  const auto independent = find_residuals(field, bare_set(24, false, field));
  REQUIRE(independent.has_value());
  CHECK(independent->share == 0.0);
  const auto alike = find_residuals(field, bare_set(24, true, field));
  REQUIRE(alike.has_value());
  CHECK(alike->share > 0.5);
  CHECK(alike->views.size() == 24);
}

TEST_CASE("residuals come back from a model's archive and change its views") {
  GridField field = small_grid(32);
  const TrainingSet set = bare_set(12, true, field);
  field.residuals = std::make_shared<const ViewResiduals>(*find_residuals(field, set));
  const GridField again = restore_grid_field(field.state(), "test");
  REQUIRE(again.residuals != nullptr);
  CHECK(again.residuals->share == field.residuals->share);
  const Acquisition& a = set.images[5].acquisition;
  const Image<float> one = render_view(field, a), two = render_view(again, a);
  double change = 0.0, difference = 0.0;
  for (std::size_t n = 0; n < one.pixels().size(); ++n) {
    difference = std::max(difference, std::abs(double{one.pixels()[n]} - double{two.pixels()[n]}));
    change = std::max(change, std::abs(double{one.pixels()[n]} - 1.0));
  }
  CHECK(difference < 2e-3);  // half-precision numbers up to 3
  CHECK(change > 0.1);
  Archive damaged = field.state();
  damaged.tensors["amplitude_residuals"] = torch::zeros({7}, torch::kHalf);
  CHECK_THROWS_AS(restore_grid_field(damaged, "test"), CheckpointError);
}

TEST_CASE("a field that returns too little says by how much") {
  GridField field = small_grid(33);
  TrainingSet set = bare_set(4, false, field);
  let_shine(field, set);
  const double scale = field.source_scale();
  field.set_source_scale(1.3 * scale);
  for (PosedImage& image : set.images) image.power = render_view(field, image.acquisition);
  field.set_source_scale(scale);
  CHECK(returned_share(field, set) == Approx(1.3).epsilon(1e-3));
  CHECK(field.source_scale() == scale);
  set.clutter.reset();
  CHECK(returned_share(field, set) == 1.0);
}

TEST_CASE("targets share residuals as far as they glint") {
  GridField field = small_grid(34);
  TrainingSet set = bare_set(24, false, field);
  let_shine(field, set);
  // The field's own images, what shines in them having that many looks; the ground has 8.
  const auto shares = [&](double looks) {
    std::mt19937 random(5);
    std::gamma_distribution<double> of_ground(8.0, 1.0 / 8.0), of_target(looks, 1.0 / looks);
    for (PosedImage& image : set.images) {
      image.power = render_view(field, image.acquisition);
      for (float& p : image.power.pixels()) p *= static_cast<float>(p > 4e-3f ? of_target(random) : of_ground(random));
    }
    return *find_residuals(field, set);
  };
  const ViewResiduals speckle = shares(4.0), glints = shares(0.1);
  CHECK(speckle.glints > 0.0);
  CHECK(speckle.glints < 0.05);
  CHECK(speckle.target_share < 0.2);
  CHECK(glints.glints > 0.15);
  CHECK(glints.target_share > 0.6);
}
