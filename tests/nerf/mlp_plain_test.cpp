// SPDX-License-Identifier: Apache-2.0
// The network in plain LibTorch against scalar arithmetic and central differences in double.
#include <array>
#include <cmath>

#include "mlp_cases.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::vector<double> encoded(const glm::dvec3& x, int n_frequencies) {
  if (n_frequencies < 0) return {};
  std::vector<double> out{x.x, x.y, x.z};
  for (int l = 0; l < n_frequencies; ++l) {
    for (int axis = 0; axis < 3; ++axis) out.push_back(std::sin(std::pow(2.0, l) * M_PI * x[axis]));
    for (int axis = 0; axis < 3; ++axis) out.push_back(std::cos(std::pow(2.0, l) * M_PI * x[axis]));
  }
  return out;
}

/// The network written down from its description: one point, double throughout.
std::pair<double, double> reference(const MlpNetwork& network, const glm::dvec3& point_m, const glm::dvec3& d) {
  const MlpShape& shape = network.shape;
  const auto* p = network.parameters.data_ptr<double>();
  const auto affine = [&](const std::vector<double>& x, int n_out) {
    std::vector<double> y;
    const double* bias = p + static_cast<std::ptrdiff_t>(x.size()) * n_out;
    for (int row = 0; row < n_out; ++row) {
      y.push_back(bias[row]);
      for (const double value : x) y.back() += *p++ * value;
    }
    p += n_out;
    return y;
  };
  const auto relu = [](std::vector<double> x) {
    for (double& value : x) value = value > 0.0 ? value : 0.0;
    return x;
  };
  const auto joined = [](std::vector<double> a, const std::vector<double>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  const glm::dvec3 unit = (point_m - network.box_m.centre()) / (0.5 * network.box_m.size());
  const std::vector<double> position = encoded(unit, shape.position_frequencies);
  std::vector<double> h = position;
  for (int l = 0; l < shape.depth; ++l) {
    if (l > 0 && l - 1 == shape.skip) h = joined(position, h);
    h = relu(affine(h, shape.width));
  }
  const double sigma = affine(h, 1)[0];
  h = joined(affine(h, shape.width), encoded(d, shape.direction_frequencies));
  h = relu(affine(h, shape.width / 2));
  return {sigma, affine(h, 1)[0]};
}

MlpNetwork network_in_double(const MlpShape& shape, std::uint64_t seed) {
  MlpNetwork network = make_mlp_network(shape, some_box(), seed);
  torch::NoGradGuard no_grad;
  network.parameters = network.parameters.to(torch::kDouble);
  // Biases are made 0, where their mistakes would not show.
  for (const MlpLayer& layer : mlp_layers(shape))
    network.bias(layer).copy_(0.2 * torch::sin(torch::arange(layer.n_out, torch::kDouble)));
  network.parameters.set_requires_grad(true);
  return network;
}

}  // namespace

TEST_CASE("the paper's network has 595,586 parameters") {
  const MlpShape shape;
  CHECK(mlp_parameter_count(shape) == 595586);
  std::int64_t next = 0;
  for (const MlpLayer& layer : mlp_layers(shape)) {
    CHECK(layer.weight == next);
    CHECK(layer.bias == next + layer.n_in * layer.n_out);
    next = layer.bias + layer.n_out;
  }
  CHECK(next == 595586);
  CHECK(encoded_size(10) == 63);
  CHECK(encoded_size(4) == 27);
}

TEST_CASE("impossible networks are refused") {
  CHECK_THROWS_AS(mlp_layers({.depth = 0, .skip = -1}), UsageError);
  CHECK_THROWS_AS(mlp_layers({.width = 7}), UsageError);
  CHECK_THROWS_AS(mlp_layers({.depth = 4, .skip = 3}), UsageError);
  CHECK_THROWS_AS(mlp_layers({.position_frequencies = -1}), UsageError);
  CHECK_THROWS_AS(mlp_layers({.direction_frequencies = -2}), UsageError);
  Box flat;
  flat.include({0.0, 0.0, 0.0});
  flat.include({1.0, 0.0, 1.0});
  CHECK_THROWS_AS(make_mlp_network({}, flat, 1), UsageError);
  CHECK_THROWS_AS(make_mlp_network({}, Box{}, 1), UsageError);
}

TEST_CASE("a seed makes the same network again, within its bounds") {
  const MlpShape shape;
  const MlpNetwork a = make_mlp_network(shape, some_box(), 5), b = make_mlp_network(shape, some_box(), 5),
                   c = make_mlp_network(shape, some_box(), 6);
  CHECK(a.parameters.requires_grad());
  CHECK(torch::equal(a.parameters, b.parameters));
  CHECK_FALSE(torch::equal(a.parameters, c.parameters));
  for (const MlpLayer& layer : mlp_layers(shape)) {
    const double bound = std::sqrt(6.0 / static_cast<double>(layer.n_in + layer.n_out));
    const torch::Tensor w = a.weight(layer);
    CHECK(w.abs().max().item<double>() <= bound);
    CHECK(w.abs().max().item<double>() > 0.9 * bound);
    // The standard deviation of a uniform distribution, within four of its own.
    const double deviation = std::sqrt(w.pow(2).mean().item<double>());
    CHECK(deviation == Approx(bound / std::sqrt(3.0)).epsilon(2.0 / std::sqrt(static_cast<double>(w.numel()))));
    CHECK(a.bias(layer).abs().max().item<double>() == 0.0);
  }
}

TEST_CASE("plain LibTorch computes what the network's description says") {
  for (const MlpShape& shape :
       {MlpShape{}, MlpShape{3, 8, 1, 2, 1}, MlpShape{2, 6, 0, 0, 3}, MlpShape{1, 4, -1, 3, 0}, MlpShape{2, 6, 0, 2, -1}}) {
    const MlpNetwork network = network_in_double(shape, 3);
    const Rays rays = random_rays(40, 4);
    const MlpOutput out = evaluate(network, rays, MlpKernel::plain);
    REQUIRE(out.sigma_raw.numel() == 40);
    REQUIRE(out.s_raw.scalar_type() == torch::kDouble);
    for (std::size_t q = 0; q + 1 < rays.begin.size(); ++q) {
      for (std::size_t n = rays.begin[q]; n < rays.begin[q + 1]; ++n) {
        const auto [sigma, s] = reference(network, glm::dvec3(rays.point_m[n]), glm::dvec3(rays.direction[q]));
        const auto k = static_cast<std::int64_t>(n);
        // The half sizes of the box are float32 in between; 2⁹ π times their error is left.
        CHECK(out.sigma_raw[k].item<double>() == Approx(sigma).epsilon(1e-4).margin(1e-4));
        CHECK(out.s_raw[k].item<double>() == Approx(s).epsilon(1e-4).margin(1e-4));
      }
    }
  }
}

TEST_CASE("gradients of plain LibTorch are central differences") {
  const MlpShape shape{3, 8, 1, 2, 1};
  MlpNetwork network = network_in_double(shape, 7);
  const Rays rays = random_rays(25, 8);
  const torch::Tensor g_sigma = torch::linspace(-1.0, 2.0, 25, torch::kDouble), g_s = g_sigma.flip(0) * 0.5;
  const torch::Tensor found = gradient(network, rays, MlpKernel::plain, g_sigma, g_s);
  torch::NoGradGuard no_grad;
  auto* p = network.parameters.data_ptr<double>();
  const auto loss = [&] {
    const MlpOutput out = evaluate(network, rays, MlpKernel::plain);
    return ((out.sigma_raw * g_sigma).sum() + (out.s_raw * g_s).sum()).item<double>();
  };
  for (std::int64_t n = 0; n < network.parameters.numel(); ++n) {
    const double kept = p[n], step = 1e-6;
    p[n] = kept + step;
    const double above = loss();
    p[n] = kept - step;
    const double below = loss();
    p[n] = kept;
    CHECK(found[n].item<double>() == Approx((above - below) / (2.0 * step)).epsilon(1e-5).margin(1e-6));
  }
}

TEST_CASE("activations that are not kept are computed again") {
  const MlpNetwork network = network_in_double({3, 8, 1, 2, 1}, 9);
  const Rays rays = random_rays(20000, 10);
  const torch::Tensor g_sigma = torch::linspace(-1.0, 2.0, 20000, torch::kDouble).clamp_min(0.0), g_s = g_sigma.square();
  const auto result = [&](double most_kept_bytes) {
    const MlpOutput out = mlp_forward_torch(network, rays.point_m, rays.direction, rays.begin, torch::kDouble, most_kept_bytes);
    const torch::Tensor g = torch::autograd::grad({out.sigma_raw, out.s_raw}, {network.parameters}, {g_sigma, g_s})[0];
    return std::array{out.sigma_raw.detach(), out.s_raw.detach(), g};
  };
  const auto kept = result(1e9), again = result(0.0);
  for (std::size_t n = 0; n < kept.size(); ++n) CHECK(torch::allclose(kept[n], again[n], 1e-9, 1e-9));
}

TEST_CASE("arrays that do not belong together are refused") {
  const MlpShape shape{2, 64, 0, 2, 1};
  const MlpNetwork network = make_mlp_network(shape, some_box(), 1);
  const std::vector<glm::vec3> points(5), one(1), two(2);
  const auto call = [&](std::vector<std::uint32_t> begin, const std::vector<glm::vec3>& rays) {
    return mlp_forward(network, points, rays, begin);
  };
  CHECK(call({0, 5}, one).s_raw.numel() == 5);
  CHECK(call({0, 0, 5}, two).s_raw.numel() == 5);
  CHECK_THROWS_AS(call({0, 5}, two), UsageError);
  CHECK_THROWS_AS(call({0, 4}, one), UsageError);
  CHECK_THROWS_AS(call({1, 5}, one), UsageError);
  CHECK_THROWS_AS(call({0, 6, 5}, two), UsageError);
  MlpNetwork other = network;
  other.parameters = torch::zeros({7});
  CHECK_THROWS_AS(mlp_forward(other, points, one, std::vector<std::uint32_t>{0, 5}), UsageError);
}
