// SPDX-License-Identifier: Apache-2.0
// The paper's way in plain LibTorch against its formulas written out, and that it learns.
#include <cmath>

#include "../nerf/torch_catch.h"
#include "plain_learner.h"
#include "sarnerf/dataset/posed_image.h"

using namespace sarnerf;
using namespace sarnerf::bench;

namespace {

Acquisition view_at(double azimuth_rad) {
  Acquisition a;
  a.azimuth_rad = azimuth_rad;
  a.slant_range_m = 5000.0;
  a.n_azimuth = 3;
  a.n_range = 6;
  a.azimuth_spacing_m = 0.5;
  a.range_spacing_m = 0.4;
  return a;
}

/// Views of 3 × 6 pixels of a scene that shines in the middle.
TrainingSet tiny_set() {
  std::vector<PosedImage> images;
  for (const double azimuth_rad : {0.3, 2.0, 4.1}) {
    const Acquisition a = view_at(azimuth_rad);
    Image<float> power(a.n_azimuth, a.n_range);
    for (int i = 0; i < a.n_azimuth; ++i) {
      for (int j = 2; j < 4; ++j) power(i, j) = 0.5f + 0.1f * static_cast<float>(i + j);
    }
    images.push_back({"view", a, power});
  }
  Box box_m;
  box_m.include({-1.5, 0.0, -1.5});
  box_m.include({1.5, 1.2, 1.5});
  return training_set(std::move(images), box_m);
}

PlainOptions small_options() {
  PlainOptions options;
  options.shape = {3, 32, 1, 3, 2};
  options.seed = 4;
  options.rate = 5e-3;
  return options;
}

}  // namespace

TEST_CASE("a plain row is the sum over rays of scattering behind inclusive products") {
  const PlainLearner learner(tiny_set(), small_options());
  const Acquisition a = view_at(1.1);
  const RayGrid grid = learner.rays(a);
  REQUIRE(grid.fan().n_elevation == 6);
  const torch::NoGradGuard no_grad;
  MlpNetwork in_double = learner.network();
  in_double.parameters = in_double.parameters.detach().to(torch::kDouble);
  for (int i = 0; i < a.n_azimuth; ++i) {
    const torch::Tensor row = learner.render_row(grid, i, MlpKernel::plain);
    REQUIRE(row.numel() == 6);
    std::vector<double> expected(6, 0.0);
    for (int k = 0; k < 6; ++k) {
      double transmittance = 1.0;
      for (int j = 0; j < 6; ++j) {
        const glm::vec3 point(grid.point_from_aim_m(a.row_offset_m(i), a.bin_offset_m(j), k));
        const glm::vec3 direction(grid.direction(k));
        const std::vector<std::uint32_t> ray_begin{0, 1};
        const MlpOutput out = mlp_forward(in_double, {&point, 1}, {&direction, 1}, ray_begin, MlpKernel::plain);
        const double sigma = std::max(0.0, out.sigma_raw.item<double>());
        const double source = learner.source_scale() * std::log1p(std::exp(out.s_raw.item<double>()));
        transmittance *= std::exp(-sigma);
        const double r_m = a.slant_range_m + (j - 2.5) * a.range_spacing_m;
        expected[static_cast<std::size_t>(j)] +=
            r_m * grid.fan().step_rad / a.range_spacing_m * source * transmittance * std::tanh(sigma);
      }
    }
    for (int j = 0; j < 6; ++j) {
      REQUIRE(expected[static_cast<std::size_t>(j)] > 0.0);
      CHECK(row[j].item<double>() == Approx(expected[static_cast<std::size_t>(j)]).epsilon(1e-4));
    }
  }
}

TEST_CASE("the fan of a plain view covers the scene's box") {
  const PlainLearner learner(tiny_set(), small_options());
  const RayGrid grid = learner.rays(view_at(0.3));
  Box box_m;
  box_m.include({-1.5, 0.0, -1.5});
  box_m.include({1.5, 1.2, 1.5});
  const auto [first_rad, last_rad] = angular_extent(view_at(0.3), box_m);
  CHECK(grid.fan().first_angle_rad == Approx(first_rad));
  CHECK(grid.fan().last_angle_rad() == Approx(last_rad));
}

TEST_CASE("plain whole-image steps learn") {
  PlainLearner learner(tiny_set(), small_options());
  double first = 0.0, last = 0.0;
  for (int n = 0; n < 90; ++n) {
    learner.step(0.0);
    if (n < 3) first += learner.last_loss();
    if (n >= 87) last += learner.last_loss();
  }
  CHECK(last < 0.3 * first);
}
