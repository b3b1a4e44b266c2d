// SPDX-License-Identifier: Apache-2.0
// The scale of the brightness after training: found again where it is known, left alone where there is no ground.
#include "train/grid_learner.h"

#include <random>

#include "ground_scene.h"
#include "sarnerf/core/error.h"
#include "sarnerf/nerf/grid_field.h"
#include "small_grid.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

constexpr double kDegree = 0.017453292519943295;

/// A level ground of power 1e-3 under bright fog.
TrainingSet set_over_ground(int n_views, GridField& field) {
  TrainingSet set;
  auto ground = std::make_shared<LevelGround>();
  ground->height_m = -2.0;
  ground->texture = Image<float>(3, 3, 1e-3f);
  ground->first_x_m = ground->first_z_m = -1.0;
  ground->incidence_rad = {0.8};
  ground->gain = {1.0};
  field.ground = ground;
  field.log_depth.requires_grad_(false).fill_(0.0f);
  for (int v = 0; v < n_views; ++v) {
    const Acquisition a = small_acquisition(0.2 * kDegree * v);
    set.images.push_back({"view", a, Image<float>(a.n_azimuth, a.n_range)});
  }
  set.ground.emplace();
  set.ground->plane = ground;
  return set;
}

}  // namespace

TEST_CASE("a field that returns too little says by how much") {
  GridField field = small_grid(33);
  TrainingSet set = set_over_ground(4, field);
  const double scale = field.source_scale();
  field.set_source_scale(1.3 * scale);
  for (PosedImage& image : set.images) image.power = render_view(field, image.acquisition);
  field.set_source_scale(scale);
  CHECK(returned_share(field, set) == Approx(1.3).epsilon(1e-3));
  CHECK(field.source_scale() == scale);
  set.ground.reset();
  CHECK(returned_share(field, set) == 1.0);
}

TEST_CASE("a field as bright as its images keeps its scale, and one whose targets glint, too") {
  GridField field = small_grid(34);
  TrainingSet set = set_over_ground(24, field);
  // The field's own images, brighter than they should be, under speckle of that many looks; the ground has 8.
  const auto share = [&](double looks, double brighter) {
    std::mt19937 random(5);
    std::gamma_distribution<double> of_ground(8.0, 1.0 / 8.0), of_target(looks, 1.0 / looks);
    for (PosedImage& image : set.images) {
      image.power = render_view(field, image.acquisition);
      for (float& p : image.power.pixels())
        p *= static_cast<float>(p > 4e-3f ? brighter * of_target(random) : of_ground(random));
    }
    return returned_share(field, set);
  };
  CHECK(share(16.0, 1.0) == Approx(1.0).epsilon(0.02));
  CHECK(share(16.0, 1.2) == Approx(1.2).epsilon(0.02));
  CHECK(share(0.1, 1.2) == 1.0);
}
