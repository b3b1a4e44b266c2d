// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mlp_evaluate.h"

namespace sarnerf {
namespace {

/// [n, 3] of the given type, from vectors of float32.
torch::Tensor tensor_of(std::span<const glm::vec3> vectors, torch::ScalarType type) {
  torch::Tensor t = torch::empty({static_cast<std::int64_t>(vectors.size()), 3}, torch::kFloat);
  float* p = t.data_ptr<float>();
  for (const glm::vec3& v : vectors) {
    *p++ = v.x;
    *p++ = v.y;
    *p++ = v.z;
  }
  return t.to(type);
}

/// Printed eq. 27 with the vector itself in front. [n, 3] → [n, encoded_size(L)]
torch::Tensor encode(const torch::Tensor& x, int n_frequencies) {
  std::vector<torch::Tensor> parts{x};
  for (int l = 0; l < n_frequencies; ++l) {
    const torch::Tensor angle = x * (std::ldexp(std::numbers::pi, l));
    parts.push_back(angle.sin());
    parts.push_back(angle.cos());
  }
  return torch::cat(parts, 1);
}

}  // namespace

MlpOutput mlp_forward_plain(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin) {
  const MlpShape& shape = network.shape;
  const auto type = network.parameters.scalar_type();
  const auto n_samples = static_cast<std::int64_t>(point_m.size());

  const std::vector<MlpLayer> layers = mlp_layers(shape);
  std::vector<std::int64_t> sizes;
  for (const MlpLayer& layer : layers) {
    sizes.push_back(layer.n_in * layer.n_out);
    sizes.push_back(layer.n_out);
  }
  // One split, whose gradient is one concatenation.
  const std::vector<torch::Tensor> parts = network.parameters.split_with_sizes(sizes);
  std::size_t next = 0;
  const auto affine = [&](const torch::Tensor& x) {
    const torch::Tensor w = parts[2 * next].view({layers[next].n_out, layers[next].n_in});
    return torch::addmm(parts[2 * next++ + 1], x, w.t());
  };

  const glm::vec3 centre(network.box_m.centre()), inverse_half(2.0 / network.box_m.size());
  const torch::Tensor position = encode((tensor_of(point_m, type) - tensor_of({&centre, 1}, type)) *
                                            tensor_of({&inverse_half, 1}, type),
                                        shape.position_frequencies);  // [n_samples, 63]
  torch::Tensor ray = torch::empty({n_samples}, torch::kLong);
  for (std::size_t q = 0; q + 1 < ray_begin.size(); ++q) {
    std::fill(ray.data_ptr<std::int64_t>() + ray_begin[q], ray.data_ptr<std::int64_t>() + ray_begin[q + 1],
              static_cast<std::int64_t>(q));
  }
  const torch::Tensor direction =
      encode(tensor_of(ray_direction, type), shape.direction_frequencies).index_select(0, ray);  // [n_samples, 27]

  torch::Tensor h = position;  // [n_samples, width]
  for (int l = 0; l < shape.depth; ++l) {
    if (l > 0 && l == shape.skip + 1) h = torch::cat({position, h}, 1);
    h = affine(h).relu();
  }
  const torch::Tensor sigma = affine(h);
  h = affine(h);
  h = affine(torch::cat({h, direction}, 1)).relu();
  return {sigma.view({n_samples}), affine(h).view({n_samples})};
}

}  // namespace sarnerf
