// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/csrc/autograd/autograd.h>

#include <random>
#include <string_view>
#include <utility>
#include <vector>

#include "mlp/kernel/mlp_plan.h"
#include "sarnerf/nerf/mlp_network.h"
#include "torch_catch.h"

namespace sarnerf::test {

inline Box some_box() {
  Box box;
  box.include({-10.0, 0.0, -12.0});
  box.include({10.0, 8.0, 14.0});
  return box;
}

/// Points in a box along rays of different lengths, some of them without any.
struct Rays {
  std::vector<glm::vec3> point_m, direction;
  std::vector<std::uint32_t> begin{0};
};

inline Rays random_rays(std::size_t n_points, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  const Box box = some_box();
  const glm::vec3 low(box.min), size(box.size());
  Rays rays;
  while (rays.point_m.size() < n_points) {
    const auto longest = std::min<std::size_t>(n_points - rays.point_m.size(), 50);
    const std::size_t n = random() % (longest + 1);
    for (std::size_t k = 0; k < n; ++k)
      rays.point_m.push_back(low + size * glm::vec3(unit(random), unit(random), unit(random)));
    rays.begin.push_back(static_cast<std::uint32_t>(rays.point_m.size()));
    rays.direction.push_back(glm::normalize(glm::vec3(unit(random) - 0.5f, -1.0f, unit(random) - 0.5f)));
  }
  return rays;
}

inline MlpOutput evaluate(const MlpNetwork& network, const Rays& rays, MlpKernel kernel) {
  return mlp_forward(network, rays.point_m, rays.direction, rays.begin, kernel);
}

/// The kernels of AMX, or the same passes with emulated tiles.
struct FusedKernel {
  std::string_view name;
  MlpKernelFunctions functions;
};

inline MlpOutput evaluate(const MlpNetwork& network, const Rays& rays, const FusedKernel& kernel) {
  return mlp_forward_fused(network, rays.point_m, rays.direction, rays.begin, kernel.functions);
}

/// Gradient of Σ g_σ σ_r + g_S S_r by the parameters.
template <class Kernel>
torch::Tensor gradient(const MlpNetwork& network, const Rays& rays, const Kernel& kernel, const torch::Tensor& sigma_weight,
                       const torch::Tensor& s_weight) {
  const MlpOutput out = evaluate(network, rays, kernel);
  return torch::autograd::grad({out.sigma_raw, out.s_raw}, {network.parameters}, {sigma_weight, s_weight})[0];
}

/// Those that this processor can run, for networks of this shape.
inline std::vector<FusedKernel> fused_kernels([[maybe_unused]] const MlpShape& shape) {
  std::vector<FusedKernel> kernels;
#ifdef SARNERF_MLP_EMULATED
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512bf16") && fused_kernels_fit(shape))
    kernels.push_back({"emulated", {mlp_emulated::pack, mlp_emulated::forward, mlp_emulated::backward}});
  if (mlp_kernel_runs(MlpKernel::amx_bf16, shape))
    kernels.push_back({"amx-bf16", {mlp_amx::pack, mlp_amx::forward, mlp_amx::backward}});
#endif
  static bool warned = false;
  if (kernels.empty() && !std::exchange(warned, true))
    WARN("no AVX512-BF16 here, or a network that fits no tile: nothing is checked of the fused kernels");
  return kernels;
}

/// Those that users can choose beside `plain`, on this processor.
inline std::vector<MlpKernel> bf16_kernels(const MlpShape& shape) {
  std::vector<MlpKernel> kernels;
  for (const MlpKernel kernel : {MlpKernel::bf16, MlpKernel::amx_bf16})
    if (mlp_kernel_runs(kernel, shape)) kernels.push_back(kernel);
  return kernels;
}

}  // namespace sarnerf::test
