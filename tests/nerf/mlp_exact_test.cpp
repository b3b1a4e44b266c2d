// SPDX-License-Identifier: Apache-2.0
// The fused kernels on numbers that bf16 and float32 hold exactly: nothing is rounded, so they must give the bits of
// plain LibTorch. A misplaced tile, column, bias or sample shows at once.
#include "mlp_cases.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// A box whose half sizes are powers of two, so that even their inverse is exact.
Box exact_box() {
  Box box;
  box.include({-16.0, 0.0, -8.0});
  box.include({16.0, 8.0, 8.0});
  return box;
}

/// Weights 0 and ±1, two of them in each row and column of the parts that gradients pass through; biases that are
/// multiples of a quarter; no frequencies. Values stay multiples of a quarter below 64, gradients small integers.
MlpNetwork exact_network(MlpShape shape) {
  shape.position_frequencies = shape.direction_frequencies = 0;
  MlpNetwork network = make_mlp_network(shape, exact_box(), 1);
  torch::NoGradGuard no_grad;
  std::int64_t seen = 0;
  for (const MlpLayer& layer : mlp_layers(shape)) {
    ++seen;
    torch::Tensor w = network.weight(layer), b = network.bias(layer);
    w.zero_();
    const std::int64_t before = layer.n_in < shape.width ? 0 : shape.width / (layer.name == "s" ? 2 : 1);
    const bool position = layer.name == "trunk" && layer.n_in != shape.width;
    const std::int64_t first = position ? 3 : 0;
    for (std::int64_t row = 0; row < layer.n_out; ++row) {
      if (layer.n_out == 1) {
        for (std::int64_t c = 0; c < layer.n_in; ++c) w[0][c] = (c * 7 + seen) % 3 - 1;
        continue;
      }
      if (before > 0) {
        w[row][first + (row + 5 * seen) % before] = row % 3 == 0 ? -1 : 1;
        w[row][first + (row + 11 * seen + layer.n_out) % before] = 1;
      }
      if (position) w[row][(row + seen) % 3] = row % 2 == 0 ? 1 : -1;
      if (layer.name == "direction") w[row][before + row % 3] = row % 4 < 2 ? 1 : -1;
    }
    for (std::int64_t row = 0; row < layer.n_out; ++row)
      b[row] = 0.25 * static_cast<double>((3 * row + seen) % 5 - 2);
  }
  return network;
}

/// Points whose place in the box and directions whose components are multiples of a quarter.
Rays exact_rays(std::size_t n_points, std::uint64_t seed) {
  Rays rays = random_rays(n_points, seed);
  std::mt19937_64 random(seed);
  const auto quarters = [&] {
    glm::vec3 v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = 0.25f * (static_cast<float>(random() % 9) - 4.0f);
    return v;
  };
  const glm::vec3 centre(exact_box().centre()), half(0.5 * exact_box().size());
  for (glm::vec3& p : rays.point_m) p = centre + half * quarters();
  for (glm::vec3& d : rays.direction) d = quarters();
  return rays;
}

}  // namespace

TEST_CASE("fused kernels equal plain LibTorch where nothing is rounded") {
  for (const MlpShape& shape : {MlpShape{3, 64, 1}, MlpShape{2, 64, 0}, MlpShape{1, 128, -1}, MlpShape{2, 192, -1},
                                MlpShape{3, 256, 0}}) {
    const MlpNetwork network = exact_network(shape);
    for (const std::size_t n : {1, 31, 32, 33, 1000, 1025, 2500}) {
      const Rays rays = exact_rays(n, n);
      torch::manual_seed(static_cast<std::int64_t>(n));
      const auto count = static_cast<std::int64_t>(n);
      const torch::Tensor g_sigma = torch::randint(-1, 2, {count}).to(torch::kFloat);
      const torch::Tensor g_s = torch::randint(-1, 2, {count}).to(torch::kFloat);
      const MlpOutput expected = evaluate(network, rays, MlpKernel::plain);
      const torch::Tensor expected_gradient = gradient(network, rays, MlpKernel::plain, g_sigma, g_s);
      REQUIRE(expected.s_raw.abs().max().item<double>() > 0.0);
      REQUIRE(expected_gradient.abs().max().item<double>() > 0.0);
      for (const FusedKernel& kernel : fused_kernels(shape)) {
        INFO(kernel.name << ", depth " << shape.depth << ", width " << shape.width << ", " << n << " points");
        const MlpOutput found = evaluate(network, rays, kernel);
        CHECK(torch::equal(found.sigma_raw, expected.sigma_raw));
        CHECK(torch::equal(found.s_raw, expected.s_raw));
        const torch::Tensor found_gradient = gradient(network, rays, kernel, g_sigma, g_s);
        for (const MlpLayer& layer : mlp_layers(network.shape)) {
          INFO("layer " << layer.name << " at " << layer.weight);
          const std::int64_t n_weights = layer.n_in * layer.n_out;
          CHECK(torch::equal(found_gradient.narrow(0, layer.weight, n_weights),
                             expected_gradient.narrow(0, layer.weight, n_weights)));
          CHECK(torch::equal(found_gradient.narrow(0, layer.bias, layer.n_out),
                             expected_gradient.narrow(0, layer.bias, layer.n_out)));
        }
      }
    }
  }
}
