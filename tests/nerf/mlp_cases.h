// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <torch/csrc/autograd/autograd.h>

#include <random>
#include <vector>

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

/// Gradient of Σ g_σ σ_r + g_S S_r by the parameters.
inline torch::Tensor gradient(const MlpNetwork& network, const Rays& rays, MlpKernel kernel,
                              const torch::Tensor& sigma_weight, const torch::Tensor& s_weight) {
  const MlpOutput out = evaluate(network, rays, kernel);
  return torch::autograd::grad({out.sigma_raw, out.s_raw}, {network.parameters}, {sigma_weight, s_weight})[0];
}

/// The fused kernels that this processor has for networks of this shape.
inline std::vector<MlpKernel> fused_kernels(const MlpShape& shape) {
  std::vector<MlpKernel> kernels;
  for (MlpKernel kernel : {MlpKernel::avx512_bf16, MlpKernel::amx_bf16})
    if (kernel <= best_mlp_kernel(shape)) kernels.push_back(kernel);
  return kernels;
}

}  // namespace sarnerf::test
