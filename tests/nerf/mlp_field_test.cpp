// SPDX-License-Identifier: Apache-2.0
// The field `mlp`: rows against the matrix form in plain LibTorch, in double, and what is left out against all of it.
#include "sarnerf/nerf/mlp_field.h"

#include <torch/csrc/autograd/autograd.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/metrics.h"
#include "sarnerf/nerf/mlp_network.h"
#include "sarnerf/nerf/row_renderer.h"
#include "small_grid.h"
#include "small_mlp.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

RaySampling fine_sampling(double end_depth) {
  RaySampling sampling = small_sampling();
  sampling.longest_m = 0.01;
  sampling.end_depth = end_depth;
  return sampling;
}

}  // namespace

TEST_CASE("segments of rows lie one behind the other where their bins are") {
  const MlpField field = small_mlp(31);
  const auto rows = some_rows();
  const RowSegments segments(rows, small_sampling(), field.cache());
  const auto places = segments.places();
  REQUIRE(segments.n_segments() > 100);
  std::size_t n_joined = 0;
  for (std::size_t q = 0; q + 1 < segments.ray_begin().size(); ++q) {
    for (std::uint32_t s = segments.ray_begin()[q]; s < segments.ray_begin()[q + 1]; ++s) {
      const auto& p = places[s];
      const Acquisition& a = rows[p.row].acquisition;
      const double length_bins = p.length_m / a.range_spacing_m;
      const RadarPoint at = project(a, radar_frame(a), glm::dvec3(segments.point_m()[s]));
      CHECK(at.range_offset_m / a.range_spacing_m + 0.5 * a.n_range ==
            Approx(p.near_bin + 0.5 * length_bins).margin(1e-4));
      CHECK(std::abs(at.along_track_m - a.row_offset_m(rows[p.row].row)) <=
            0.5 * a.azimuth_spacing_m + 1e-5);
      CHECK(p.length_m <= small_sampling().longest_m * (1.0 + 1e-3));
      CHECK(std::floor(p.near_bin + 1e-3) >= std::floor(p.near_bin + length_bins - 1e-3));
      if (s == segments.ray_begin()[q]) continue;
      const auto& before = places[s - 1];
      const double gap = p.near_bin - (before.near_bin + before.length_m / a.range_spacing_m);
      CHECK(gap > -1e-4);
      n_joined += gap < 1e-4 ? 1 : 0;
    }
  }
  CHECK(n_joined > segments.n_segments() / 2);
}

TEST_CASE(
    "rows and gradients of the field mlp agree with plain LibTorch in double and with central "
    "differences") {
  const Integrator integrator = GENERATE(Integrator::exact, Integrator::paper_gated);
  CAPTURE(name(integrator));
  MlpField field = small_mlp(32, integrator);
  field.use_kernel(MlpKernel::plain);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  const torch::Tensor native = field.render_rows(rows, sampling);
  torch::Tensor parameters =
      field.network().parameters.detach().to(torch::kDouble).requires_grad_();
  const torch::Tensor plain = plain_rows(field, parameters, rows, sampling);
  REQUIRE(native.sizes() == plain.sizes());
  const double largest = plain.max().item<double>();
  REQUIRE(largest > 0.01);
  CHECK((native.to(torch::kDouble) - plain).abs().max().item<double>() < 1e-5 * largest);

  torch::manual_seed(5);
  const torch::Tensor weights = torch::randn({native.size(0)}, torch::kDouble);
  const auto gradient = [&](const torch::Tensor& pixels, const torch::Tensor& p) {
    return torch::autograd::grad({(pixels.to(torch::kDouble) * weights).sum()}, {p})[0].to(
        torch::kDouble);
  };
  const torch::Tensor d_native = gradient(native, field.network().parameters);
  const torch::Tensor d_plain = gradient(plain, parameters);
  CHECK((d_native - d_plain).abs().max().item<double>() <
        1e-4 * d_plain.abs().max().item<double>());

  const torch::Tensor direction = d_plain / d_plain.norm();
  const torch::NoGradGuard no_grad;
  constexpr double kStep = 1e-6;
  const auto moved = [&](double step) {
    return (plain_rows(field, parameters + step * direction, rows, sampling) * weights)
        .sum()
        .item<double>();
  };
  CHECK((moved(kStep) - moved(-kStep)) / (2.0 * kStep) ==
        Approx((d_native * direction).sum().item<double>()).epsilon(1e-3));
}

TEST_CASE(
    "leaving out empty space and what opaque matter hides changes nothing beyond the tolerance") {
  MlpField field = small_mlp(33);
  field.use_kernel(MlpKernel::plain);
  const auto rows = some_rows();
  const auto image = [&](double end_depth) {
    return field.render_rows(rows, fine_sampling(end_depth)).detach();
  };
  const std::size_t n_all = field.cache().n_voxels(), n_occupied = field.cache().n_occupied();
  REQUIRE(n_occupied < n_all);
  REQUIRE(n_occupied > 0);

  const torch::Tensor skipped = image(1e30), ended = image(8.0);
  const double largest = skipped.max().item<double>();
  // By the voxels' depth e^−8 = 3.4e-4 lies behind; they know the depth to about a fifth.
  CHECK((skipped - ended).abs().max().item<double>() < 2e-3 * largest);
  CHECK(RowSegments(rows, fine_sampling(8.0), field.cache()).n_segments() <
        RowSegments(rows, fine_sampling(1e30), field.cache()).n_segments());
  field.refresh(-1.0);
  REQUIRE(field.cache().n_occupied() == n_all);
  CHECK((skipped - image(1e30)).abs().max().item<double>() < 1e-3 * largest);
}

TEST_CASE("matter that appears in forgotten space is found again") {
  MlpField field = small_mlp(34);
  const std::size_t n_before = field.cache().n_occupied();
  const auto sigma_bias = [&] {
    for (const MlpLayer& layer : mlp_layers(field.network().shape))
      if (layer.name == "sigma") return field.network().bias(layer);
    return torch::Tensor();
  }();
  sigma_bias.sub_(100.0);
  field.refresh(0.0);
  CHECK(field.cache().n_occupied() == 0);
  CHECK(field.render_rows(some_rows(), small_sampling()).abs().max().item<float>() == 0.0f);
  sigma_bias.add_(100.0);
  field.refresh(0.0);
  CHECK(field.cache().n_occupied() == n_before);
}

TEST_CASE("a field mlp comes back from its archive bit by bit, and damage is noticed") {
  const MlpField field = small_mlp(35, Integrator::paper_gated);
  Archive archive = field.state();
  const auto back = restore_field(archive, "file");
  REQUIRE(back->kind() == "mlp");
  const Acquisition a = small_acquisition(1.0);
  const Image<float> one = render_view(field, a), two = render_view(*back, a);
  CHECK(std::equal(one.pixels().begin(), one.pixels().end(), two.pixels().begin()));

  SECTION("weights of another network") { archive.tensors["parameters"] = torch::zeros({7}); }
  SECTION("no weights") { archive.tensors.erase("parameters"); }
  SECTION("weights that are no numbers") { archive.tensors["parameters"].fill_(NAN); }
  SECTION("too few voxels") { archive.tensors["extinction"] = torch::zeros({3}); }
  SECTION("negative extinction") { archive.tensors["extinction"].fill_(-1.0); }
  SECTION("impossible width") {
    archive.json.replace(archive.json.find("\"width\":64"), 10, "\"width\":-2");
  }
  CHECK_THROWS_AS(restore_field(archive, "file"), CheckpointError);
}

TEST_CASE("a slow BLAS is told of, a fast one is not") {
  CHECK(blas_gflop_per_s() > 0.0);
  CHECK(slow_blas_warning(4.5).find("OPENBLAS_CORETYPE") != std::string::npos);
  CHECK(slow_blas_warning(120.0).empty());
}

TEST_CASE("a field mlp over level ground shows and shades it and its gradients agree with central differences") {
  MlpField field = small_mlp(36);
  field.use_kernel(MlpKernel::plain);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  auto ground = std::make_shared<LevelGround>();
  ground->height_m = -2.0;
  ground->texture = Image<float>(3, 3, 0.5f);
  ground->incidence_rad = {0.7};
  ground->gain = {1.0};
  field.ground = ground;
  const torch::Tensor pixels = field.render_rows(rows, sampling);
  const torch::Tensor gradient = torch::autograd::grad({pixels.sum()}, {field.network().parameters})[0];
  const torch::Tensor direction = gradient / gradient.norm();

  const torch::NoGradGuard no_grad;
  field.ground = nullptr;
  CHECK((pixels - field.render_rows(rows, sampling)).max().item<float>() == Approx(0.5).epsilon(1e-4));
  CHECK((pixels - field.render_rows(rows, sampling)).min().item<float>() < 0.45f);
  field.ground = ground;
  const MlpField again = restore_mlp_field(field.state(), "test");
  REQUIRE(again.ground != nullptr);
  CHECK(again.ground->texture_at(0.0, 0.0) == Approx(0.5));
  constexpr double kStep = 2e-4;
  const auto moved = [&](double step) {
    field.network().parameters.add_(direction, step);
    const double value = field.render_rows(rows, sampling).to(torch::kDouble).sum().item<double>();
    field.network().parameters.sub_(direction, step);
    return value;
  };
  CHECK((moved(kStep) - moved(-kStep)) / (2.0 * kStep) == Approx(gradient.norm().item<double>()).epsilon(0.01));
}
