// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/mlp_network.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "mlp_evaluate.h"
#include "sarnerf/core/error.h"

namespace sarnerf {
namespace {

void check(const MlpNetwork& network, std::span<const glm::vec3> point_m,
           std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin) {
  const std::int64_t expected = mlp_parameter_count(network.shape);
  const torch::Tensor& p = network.parameters;
  if (!p.defined() || p.dim() != 1 || p.numel() != expected || !p.is_contiguous()) {
    throw UsageError("network: expected a contiguous vector of " + std::to_string(expected) +
                     " parameters, found " + std::to_string(p.defined() ? p.numel() : 0));
  }
  if (ray_begin.size() != ray_direction.size() + 1) {
    throw UsageError("network: ray_begin has " + std::to_string(ray_begin.size()) + " values, expected " +
                     std::to_string(ray_direction.size() + 1));
  }
  if (ray_begin.front() != 0 || ray_begin.back() != point_m.size()) {
    throw UsageError("network: rays have the points " + std::to_string(ray_begin.front()) + " to " +
                     std::to_string(ray_begin.back()) + ", expected 0 to " + std::to_string(point_m.size()));
  }
  if (!std::is_sorted(ray_begin.begin(), ray_begin.end())) {
    throw UsageError("network: ray_begin must not decrease");
  }
}

}  // namespace

torch::Tensor MlpNetwork::weight(const MlpLayer& layer) const {
  return parameters.detach().narrow(0, layer.weight, layer.n_out * layer.n_in).view({layer.n_out, layer.n_in});
}

torch::Tensor MlpNetwork::bias(const MlpLayer& layer) const {
  return parameters.detach().narrow(0, layer.bias, layer.n_out);
}

MlpNetwork make_mlp_network(const MlpShape& shape, const Box& box_m, std::uint64_t seed) {
  const glm::dvec3 size = box_m.size();
  if (!(size.x > 0.0 && size.y > 0.0 && size.z > 0.0 && std::isfinite(size.x + size.y + size.z))) {
    throw UsageError("network: expected a box with extent along each axis, found " + std::to_string(size.x) +
                     " x " + std::to_string(size.y) + " x " + std::to_string(size.z) + " m");
  }
  MlpNetwork network{shape, box_m, torch::zeros({mlp_parameter_count(shape)}, torch::kFloat)};
  auto* values = network.parameters.data_ptr<float>();
  std::mt19937_64 random(seed);
  for (const MlpLayer& layer : mlp_layers(shape)) {
    const double bound = std::sqrt(6.0 / static_cast<double>(layer.n_in + layer.n_out));
    // The standard's distributions differ between libraries; its generators do not.
    for (std::int64_t n = 0; n < layer.n_in * layer.n_out; ++n) {
      const double unit = static_cast<double>(random() >> 11) * 0x1p-53;
      values[layer.weight + n] = static_cast<float>(bound * (2.0 * unit - 1.0));
    }
  }
  network.parameters.set_requires_grad(true);
  return network;
}

std::string_view name(MlpKernel kernel) {
  switch (kernel) {
    case MlpKernel::plain:
      return "plain";
    case MlpKernel::avx512_bf16:
      return "avx512-bf16";
    case MlpKernel::amx_bf16:
      return "amx-bf16";
  }
  return "unknown";
}

MlpOutput mlp_forward(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                      std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                      MlpKernel kernel) {
  check(network, point_m, ray_direction, ray_begin);
  if (kernel == MlpKernel::plain) return mlp_forward_plain(network, point_m, ray_direction, ray_begin);
  if (kernel > best_mlp_kernel(network.shape)) {
    throw UsageError("network: no " + std::string(name(kernel)) +
                     " kernel on this processor, in this build or for this shape; the best one is " +
                     std::string(name(best_mlp_kernel(network.shape))));
  }
  if (network.parameters.scalar_type() != torch::kFloat) {
    throw UsageError("network: kernel " + std::string(name(kernel)) + " expects parameters of type float32");
  }
#ifdef SARNERF_MLP_KERNELS
  return mlp_forward_fused(network, point_m, ray_direction, ray_begin, kernel);
#else
  return {};  // not reached: `plain` is the best one
#endif
}

MlpOutput mlp_forward(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                      std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin) {
  return mlp_forward(network, point_m, ray_direction, ray_begin, best_mlp_kernel(network.shape));
}

}  // namespace sarnerf
