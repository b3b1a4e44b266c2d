// SPDX-License-Identifier: Apache-2.0
// The fused kernels against plain LibTorch, within what bf16 leaves, and what they promise beside numbers.
#include <cmath>

#include "mlp_cases.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

const MlpShape kShapes[] = {MlpShape{}, MlpShape{4, 64, 1, 5, 2}, MlpShape{2, 128, -1, 12, 4},
                            MlpShape{1, 64, -1, 0, 1}};

double root_mean_square(const torch::Tensor& x) { return std::sqrt(x.pow(2).mean().item<double>()); }

/// Gradients as a loss has them: of one sign for the most part, different in size.
torch::Tensor some_gradient(std::int64_t n, std::int64_t seed) {
  torch::manual_seed(seed);
  return torch::rand({n}) * torch::rand({n}) + 0.2 * torch::randn({n});
}

}  // namespace

TEST_CASE("outputs in bf16 are within 2 % of their spread") {
  for (const MlpShape& shape : kShapes) {
    const MlpNetwork network = make_mlp_network(shape, some_box(), 11);
    const Rays rays = random_rays(1500, 12);
    const MlpOutput expected = evaluate(network, rays, MlpKernel::plain);
    const auto check = [&](const auto& kernel, std::string_view name) {
      INFO(name << ", depth " << shape.depth << ", width " << shape.width);
      const MlpOutput found = evaluate(network, rays, kernel);
      const auto agree = [](const torch::Tensor& f, const torch::Tensor& e) {
        CHECK(f.scalar_type() == torch::kFloat);
        const double spread = e.std().item<double>();
        CHECK(root_mean_square(f - e) < 0.02 * spread);
        CHECK((f - e).abs().max().item<double>() < 0.1 * spread);
        CHECK(root_mean_square(f - e) > 0.0);  // it is not plain LibTorch that was called
      };
      agree(found.sigma_raw, expected.sigma_raw);
      agree(found.s_raw, expected.s_raw);
    };
    if (mlp_kernel_runs(MlpKernel::bf16, shape)) check(MlpKernel::bf16, "bf16");
    for (const FusedKernel& kernel : fused_kernels(shape)) check(kernel, kernel.name);
  }
}

TEST_CASE("gradients in bf16 point where they should") {
  for (const MlpShape& shape : kShapes) {
    const MlpNetwork network = make_mlp_network(shape, some_box(), 13);
    const Rays rays = random_rays(1500, 14);
    const torch::Tensor g_sigma = some_gradient(1500, 15), g_s = some_gradient(1500, 16);
    const torch::Tensor e = gradient(network, rays, MlpKernel::plain, g_sigma, g_s);
    const auto check = [&](const auto& kernel, std::string_view name) {
      INFO(name << ", depth " << shape.depth << ", width " << shape.width);
      const torch::Tensor f = gradient(network, rays, kernel, g_sigma, g_s);
      const auto cosine = [](const torch::Tensor& a, const torch::Tensor& b) {
        return (a.dot(b) / (a.norm() * b.norm())).template item<double>();
      };
      CHECK(cosine(f, e) > 0.999);
      CHECK((f.norm() / e.norm()).template item<double>() == Approx(1.0).margin(0.01));
      for (const MlpLayer& layer : mlp_layers(shape)) {
        INFO("layer " << layer.name << " at " << layer.weight);
        CHECK(cosine(f.narrow(0, layer.weight, layer.n_in * layer.n_out),
                     e.narrow(0, layer.weight, layer.n_in * layer.n_out)) > 0.99);
        CHECK(cosine(f.narrow(0, layer.bias, layer.n_out), e.narrow(0, layer.bias, layer.n_out)) > 0.99);
      }
    };
    if (mlp_kernel_runs(MlpKernel::bf16, shape)) check(MlpKernel::bf16, "bf16");
    for (const FusedKernel& kernel : fused_kernels(shape)) check(kernel, kernel.name);
  }
}

TEST_CASE("the same call gives the same bits") {
  const MlpShape shape{4, 128, 1};
  const MlpNetwork network = make_mlp_network(shape, some_box(), 17);
  const Rays rays = random_rays(3300, 18);
  const torch::Tensor g_sigma = some_gradient(3300, 19), g_s = some_gradient(3300, 20);
  for (const FusedKernel& kernel : fused_kernels(shape)) {
    const MlpOutput first = evaluate(network, rays, kernel);
    for (const int n_threads : {1, 2, 3}) {
      const ThreadLimit limit(n_threads);
      const torch::Tensor once = gradient(network, rays, kernel, g_sigma, g_s);
      for (int repeat = 0; repeat < 3; ++repeat) {
        const MlpOutput again = evaluate(network, rays, kernel);
        CHECK(torch::equal(again.sigma_raw, first.sigma_raw));
        CHECK(torch::equal(again.s_raw, first.s_raw));
        CHECK(torch::equal(gradient(network, rays, kernel, g_sigma, g_s), once));
      }
    }
  }
}

TEST_CASE("a sample's output does not depend on its company") {
  const MlpShape shape{2, 64, 0, 4, 2};
  const MlpNetwork network = make_mlp_network(shape, some_box(), 21);
  for (const FusedKernel& kernel : fused_kernels(shape)) {
    const Rays all = random_rays(1100, 22);
    const MlpOutput together = evaluate(network, all, kernel);
    for (std::size_t q = 0; q + 1 < all.begin.size(); q += 7) {
      Rays one;
      one.direction = {all.direction[q]};
      one.point_m.assign(all.point_m.begin() + all.begin[q], all.point_m.begin() + all.begin[q + 1]);
      one.begin.push_back(static_cast<std::uint32_t>(one.point_m.size()));
      const MlpOutput alone = evaluate(network, one, kernel);
      const std::int64_t n = alone.s_raw.numel();
      CHECK(torch::equal(alone.sigma_raw, together.sigma_raw.narrow(0, all.begin[q], n)));
      CHECK(torch::equal(alone.s_raw, together.s_raw.narrow(0, all.begin[q], n)));
    }
  }
}

TEST_CASE("samples without a gradient are left out") {
  const MlpShape shape{2, 64, 0, 4, 2};
  const MlpNetwork network = make_mlp_network(shape, some_box(), 23);
  const Rays all = random_rays(900, 24);
  // Every second ray has none: the gradient is that of the other rays alone.
  torch::Tensor g_sigma = some_gradient(900, 25), g_s = some_gradient(900, 26);
  Rays half;
  std::vector<torch::Tensor> half_sigma, half_s;
  for (std::size_t q = 0; q + 1 < all.begin.size(); ++q) {
    const std::int64_t begin = all.begin[q], n = all.begin[q + 1] - all.begin[q];
    if (q % 2 == 0) {
      g_sigma.narrow(0, begin, n).zero_();
      g_s.narrow(0, begin, n).zero_();
      continue;
    }
    half.direction.push_back(all.direction[q]);
    half.point_m.insert(half.point_m.end(), all.point_m.begin() + begin, all.point_m.begin() + begin + n);
    half.begin.push_back(static_cast<std::uint32_t>(half.point_m.size()));
    half_sigma.push_back(g_sigma.narrow(0, begin, n));
    half_s.push_back(g_s.narrow(0, begin, n));
  }
  for (const FusedKernel& kernel : fused_kernels(shape)) {
    CHECK(torch::equal(gradient(network, all, kernel, g_sigma, g_s),
                       gradient(network, half, kernel, torch::cat(half_sigma), torch::cat(half_s))));
    const torch::Tensor nothing = torch::zeros({900});
    CHECK(gradient(network, all, kernel, nothing, nothing).abs().max().item<double>() == 0.0);
  }
}

TEST_CASE("no samples give nothing") {
  const MlpShape shape{2, 64, 0, 4, 2};
  const MlpNetwork network = make_mlp_network(shape, some_box(), 27);
  const auto check = [&](const auto& kernel) {
    for (const std::size_t n_rays : {0, 1, 3}) {
      Rays none;
      none.direction.resize(n_rays, glm::vec3(0.0f, -1.0f, 0.0f));
      none.begin.resize(n_rays + 1, 0);
      const MlpOutput out = evaluate(network, none, kernel);
      CHECK(out.sigma_raw.sizes() == torch::IntArrayRef{0});
      CHECK(out.s_raw.sizes() == torch::IntArrayRef{0});
      const torch::Tensor g = gradient(network, none, kernel, torch::zeros({0}), torch::zeros({0}));
      CHECK(g.numel() == network.parameters.numel());
      CHECK(g.abs().max().template item<double>() == 0.0);
    }
  };
  check(MlpKernel::plain);
  if (mlp_kernel_runs(MlpKernel::bf16, shape)) check(MlpKernel::bf16);
  for (const FusedKernel& kernel : fused_kernels(shape)) check(kernel);
}

TEST_CASE("a kernel that does not fit the network or the processor is refused") {
  const MlpShape odd{2, 48, 0, 4, 2};
  const MlpNetwork network = make_mlp_network(odd, some_box(), 29);
  const Rays rays = random_rays(50, 30);
  CHECK(best_mlp_kernel(odd) != MlpKernel::amx_bf16);
  const MlpOutput by_default = mlp_forward(network, rays.point_m, rays.direction, rays.begin);
  CHECK(torch::equal(by_default.s_raw, evaluate(network, rays, best_mlp_kernel(odd)).s_raw));
  CHECK_THROWS_AS(evaluate(network, rays, MlpKernel::amx_bf16), UsageError);
  // LibTorch's products without AVX512-BF16 give gradients that are 5 to 8 % too short: they must not pass for the kernel's.
  if (!mlp_kernel_runs(MlpKernel::bf16, odd)) CHECK_THROWS_AS(evaluate(network, rays, MlpKernel::bf16), UsageError);

  MlpNetwork precise = make_mlp_network({2, 64, 0, 4, 2}, some_box(), 31);
  precise.parameters = precise.parameters.detach().to(torch::kDouble);
  CHECK(evaluate(precise, rays, MlpKernel::plain).s_raw.scalar_type() == torch::kDouble);
  CHECK_THROWS_AS(evaluate(precise, rays, MlpKernel::bf16), UsageError);
  CHECK_THROWS_AS(evaluate(precise, rays, MlpKernel::amx_bf16), UsageError);
}

TEST_CASE("parameters that changed before the backward pass are noticed") {
  const MlpShape shape{2, 64, 0, 4, 2};
  const MlpNetwork network = make_mlp_network(shape, some_box(), 33);
  const Rays rays = random_rays(50, 34);
  for (const FusedKernel& kernel : fused_kernels(shape)) {
    const MlpOutput out = evaluate(network, rays, kernel);
    {
      torch::NoGradGuard no_grad;
      torch::Tensor p = network.parameters;
      p.add_(1.0);
    }
    CHECK_THROWS(torch::autograd::grad({out.s_raw.sum()}, {network.parameters}));
  }
}
