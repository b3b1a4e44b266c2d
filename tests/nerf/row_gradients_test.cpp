// SPDX-License-Identifier: Apache-2.0
// The native renderer of the field `grid` against the same formulas in plain LibTorch, in double, and against
// central differences.
#include "sarnerf/nerf/grid_field.h"
#include "small_grid.h"
#include "torch_catch.h"

using namespace sarnerf;

namespace {

double weighted_sum(const GridField& field, const std::vector<RowRequest>& rows, const RaySampling& sampling,
                    const torch::Tensor& weights) {
  const torch::NoGradGuard no_grad;
  return (field.render_rows(rows, sampling).to(torch::kDouble) * weights).sum().item<double>();
}

}  // namespace

TEST_CASE("rows agree with the emission-absorption formulas in plain LibTorch") {
  const GridField field = small_grid(11);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  const torch::Tensor native = field.render_rows(rows, sampling);
  const torch::Tensor plain = plain_rows(field, rows, sampling);
  REQUIRE(native.sizes() == plain.sizes());
  const double largest = plain.max().item<double>();
  REQUIRE(largest > 0.01);
  CHECK((native.to(torch::kDouble) - plain).abs().max().item<double>() < 2e-6 * largest);
}

TEST_CASE("gradients agree with those of plain LibTorch in double") {
  GridField field = small_grid(12);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  torch::manual_seed(5);
  const torch::Tensor weights = torch::randn({rows[0].acquisition.n_range * 2}, torch::kDouble);

  (field.render_rows(rows, sampling).to(torch::kDouble) * weights).sum().backward();
  const torch::Tensor d_depth = field.log_depth.grad().clone();
  const torch::Tensor d_coefficients = field.coefficients.grad().clone();
  field.log_depth.mutable_grad() = field.coefficients.mutable_grad() = torch::Tensor();
  (plain_rows(field, rows, sampling) * weights).sum().backward();

  CHECK((d_depth - field.log_depth.grad()).abs().max().item<double>() <
        2e-5 * field.log_depth.grad().abs().max().item<double>());
  CHECK((d_coefficients - field.coefficients.grad()).abs().max().item<double>() <
        2e-5 * field.coefficients.grad().abs().max().item<double>());
}

TEST_CASE("gradients agree with central differences") {
  GridField field = small_grid(13);
  const auto rows = some_rows();
  const RaySampling sampling = small_sampling();
  torch::manual_seed(6);
  const torch::Tensor weights = torch::rand({rows[0].acquisition.n_range * 2}, torch::kDouble);
  (field.render_rows(rows, sampling).to(torch::kDouble) * weights).sum().backward();

  // Differences of float32 images: steps large enough for their rounding, small enough for their curvature.
  const auto along_gradient = [&](torch::Tensor& parameter, float step) {
    const torch::Tensor gradient = parameter.grad().clone();
    const torch::Tensor direction = gradient / gradient.norm();
    const torch::NoGradGuard no_grad;
    parameter.add_(direction, step);
    const double above = weighted_sum(field, rows, sampling, weights);
    parameter.sub_(direction, 2.0 * step);
    const double below = weighted_sum(field, rows, sampling, weights);
    parameter.add_(direction, step);
    CHECK((above - below) / (2.0 * double{step}) == Approx(gradient.norm().item<double>()).epsilon(2e-3));
  };
  along_gradient(field.log_depth, 0.02f);
  along_gradient(field.coefficients, 0.02f);
}

TEST_CASE("skipping empty space and ending opaque rays change nothing beyond their tolerance") {
  GridField field = small_grid(14);
  const auto rows = some_rows();
  RaySampling sampling = small_sampling();
  sampling.end_depth = 1e30;
  const torch::Tensor whole = field.render_rows(rows, sampling).detach();
  sampling.end_depth = 8.0;
  const torch::Tensor ended = field.render_rows(rows, sampling).detach();
  // What lies behind a depth of 8 has e^−8 of its power.
  CHECK((whole - ended).abs().max().item<double>() < 3.4e-4 * whole.max().item<double>());

  // A second field that also holds the voxels that the first one leaves out, all but empty.
  // Rays are cut into segments elsewhere then, so these must be short.
  const GridField filled = with_all_voxels(field, -60.0f);
  REQUIRE(filled.n_active() > 2 * field.n_active());
  sampling.end_depth = 1e30;
  sampling.longest_m = 0.01;
  const torch::Tensor skipped = field.render_rows(rows, sampling).detach();
  const torch::Tensor unskipped = filled.render_rows(rows, sampling).detach();
  CHECK((skipped - unskipped).abs().max().item<double>() < 1e-3 * skipped.max().item<double>());
}
