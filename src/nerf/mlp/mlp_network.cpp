// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/mlp_network.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <torch/types.h>

#include "mlp/kernel/mlp_plan.h"
#include "sarnerf/core/error.h"

namespace sarnerf {

namespace {

void expect(bool fine, const char* what, int found) {
  if (!fine) throw UsageError(std::string("network: expected ") + what + ", found " + std::to_string(found));
}

}  // namespace

std::vector<MlpLayer> mlp_layers(const MlpShape& shape) {
  expect(shape.depth >= 1, "a depth of at least 1", shape.depth);
  expect(shape.width >= 2 && shape.width % 2 == 0, "an even width of at least 2", shape.width);
  expect(shape.skip < shape.depth - 1 || shape.skip < 0, "a skip before the last layer of the trunk", shape.skip);
  expect(shape.position_frequencies >= 0 && shape.position_frequencies <= 64, "0 to 64 frequencies of the position",
         shape.position_frequencies);
  expect(shape.direction_frequencies >= 0 && shape.direction_frequencies <= 64,
         "0 to 64 frequencies of the direction", shape.direction_frequencies);

  std::vector<MlpLayer> layers;
  std::int64_t next = 0;
  const auto add = [&](std::string_view name, int n_in, int n_out) {
    const std::int64_t n_weights = std::int64_t{n_in} * n_out;
    layers.push_back({name, n_in, n_out, next, next + n_weights});
    next += n_weights + n_out;
  };
  const int position = encoded_size(shape.position_frequencies);
  for (int l = 0; l < shape.depth; ++l) {
    const int before = l == 0 ? 0 : shape.width;
    const bool sees_position = l == 0 || (shape.skip >= 0 && l == shape.skip + 1);
    add("trunk", before + (sees_position ? position : 0), shape.width);
  }
  add("sigma", shape.width, 1);
  add("bottleneck", shape.width, shape.width);
  add("direction", shape.width + encoded_size(shape.direction_frequencies), shape.width / 2);
  add("s", shape.width / 2, 1);
  return layers;
}

std::int64_t mlp_parameter_count(const MlpShape& shape) {
  const MlpLayer last = mlp_layers(shape).back();
  return last.bias + last.n_out;
}

namespace {

constexpr std::int64_t kSide = 512;
constexpr double kSlow_gflop_per_s = 20.0;

}  // namespace

double blas_gflop_per_s() {
  using Clock = std::chrono::steady_clock;
  const torch::NoGradGuard no_grad;
  const torch::Tensor a = torch::ones({kSide, kSide}), b = torch::ones({kSide, kSide});
  torch::Tensor c = torch::empty({kSide, kSide});
  double least_s = std::numeric_limits<double>::infinity();
  for (int n = 0; n < 3; ++n) {
    const auto start = Clock::now();
    torch::mm_out(c, a, b);
    least_s = std::min(least_s, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return 2e-9 * static_cast<double>(kSide * kSide * kSide) / least_s;
}

std::string slow_blas_warning(double gflop_per_s) {
  if (gflop_per_s >= kSlow_gflop_per_s) return {};
  char text[320];
  std::snprintf(
      text, sizeof text,
      "matrix products run at %.1f GFLOP/s, a tuned BLAS reaches 50 or more a thread: install "
      "libopenblas0-pthread; if it is installed and takes this processor for an older one, set "
      "OPENBLAS_CORETYPE=SkylakeX (with AVX-512) or Haswell before the program starts",
      gflop_per_s);
  return text;
}

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
