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

#include <ATen/Context.h>
#include <torch/csrc/autograd/autograd.h>
#include <torch/csrc/autograd/custom_function.h>

#include "mlp/kernel/mlp_plan.h"
#include "sarnerf/core/error.h"

#ifdef SARNERF_MLP_KERNELS
#include <cpuid.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

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
  expect(shape.direction_frequencies >= -1 && shape.direction_frequencies <= 64,
         "0 to 64 frequencies of the direction, or -1 for no direction", shape.direction_frequencies);

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

void clear_identity(const MlpShape& shape, const torch::Tensor& of_parameters) {
  const torch::NoGradGuard no_grad;
  const int position = encoded_size(shape.position_frequencies);
  bool first = true;
  for (const MlpLayer& layer : mlp_layers(shape)) {
    const bool sees_position = first || (layer.name == "trunk" && layer.n_in == position + shape.width);
    const bool sees_direction = layer.name == "direction" && shape.direction_frequencies >= 0;
    first = false;
    if (!sees_position && !sees_direction) continue;
    const int column = sees_direction ? shape.width : 0;  // of the encoded vector
    of_parameters.narrow(0, layer.weight, layer.n_in * layer.n_out).view({layer.n_out, layer.n_in}).narrow(1, column, 3).zero_();
  }
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

/// Samples that LibTorch evaluates at a time: 45 MB of activations in bf16.
constexpr std::int64_t kSamplesAtATime = 8192;

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
  if (n_frequencies < 0) return x.narrow(1, 0, 0);
  std::vector<torch::Tensor> parts{x};
  for (int l = 0; l < n_frequencies; ++l) {
    const torch::Tensor angle = x * (std::ldexp(std::numbers::pi, l));
    parts.push_back(angle.sin());
    parts.push_back(angle.cos());
  }
  return torch::cat(parts, 1);
}

/// Samples for LibTorch, and how it evaluates them. Layers of more than one output are products of numbers of `hidden_type`; the
/// encoding and the two heads are of the parameters' type. Nothing here is recorded by autograd: a network of dense layers has a
/// short gradient, and by hand it leaves out samples that have none.
struct TorchPass : torch::CustomClassHolder {
  MlpShape shape;
  std::vector<MlpLayer> layers;
  std::vector<torch::Tensor> weight, bias;  ///< of each layer, as its product takes them
  torch::ScalarType hidden_type = torch::kFloat;
  torch::Tensor place;      ///< [n, 3] in [−1, 1]³
  torch::Tensor direction;  ///< [n_rays, encoded_size(L)]
  torch::Tensor ray;        ///< [n], each sample's

  /// Each layer's input [n, n_in], of `hidden_type`.
  using Inputs = std::vector<torch::Tensor>;
  bool keeps = false;        ///< whether the forward pass keeps them
  std::vector<Inputs> kept;  ///< of kSamplesAtATime samples each

  void set_network(const MlpNetwork& network) {
    shape = network.shape;
    layers = mlp_layers(shape);
    for (const MlpLayer& layer : layers) {
      const auto type = layer.n_out == 1 ? network.parameters.scalar_type() : hidden_type;
      weight.push_back(network.weight(layer).to(type));
      bias.push_back(network.bias(layer).to(type));
    }
  }

  double bytes_of_sample() const {
    std::int64_t n = 0;
    for (const MlpLayer& layer : layers) n += layer.n_in;
    return static_cast<double>(n) * static_cast<double>(torch::elementSize(hidden_type));
  }

  /// Of samples at `index` [n]. `inputs`, empty, receives those of the layers; null: each is freed as soon as the next one
  /// is there.
  MlpOutput evaluate(const torch::Tensor& index, Inputs* inputs) const {
    std::size_t next = 0;
    const auto affine = [&](const torch::Tensor& x) {
      const std::size_t l = next++;
      if (inputs != nullptr) inputs->push_back(x);
      return torch::addmm(bias[l], x.to(weight[l].scalar_type()), weight[l].t());
    };
    const torch::Tensor position = encode(place.index_select(0, index), shape.position_frequencies).to(hidden_type);
    const torch::Tensor towards = direction.index_select(0, ray.index_select(0, index)).to(hidden_type);

    torch::Tensor h = position;  // [n, width]
    for (int l = 0; l < shape.depth; ++l) {
      if (l > 0 && l == shape.skip + 1) h = torch::cat({position, h}, 1);
      h = affine(h).relu_();
    }
    const torch::Tensor sigma = affine(h);
    h = affine(h);
    h = affine(torch::cat({h, towards}, 1)).relu_();
    return {sigma.view(-1), affine(h).view(-1)};
  }

  /// Adds ∂L/∂parameters of samples with these inputs and these derivatives by σ_r and S_r [n] to `gradient`.
  void add_gradient(const Inputs& inputs, const torch::Tensor& d_sigma, const torch::Tensor& d_s, torch::Tensor& gradient) const {
    // Adds a layer's, from the derivative by its output; returns that by its input.
    const auto back = [&](std::size_t l, const torch::Tensor& d_output) {
      const MlpLayer& layer = layers[l];
      const torch::Tensor d = d_output.to(weight[l].scalar_type());
      gradient.narrow(0, layer.weight, layer.n_out * layer.n_in).view({layer.n_out, layer.n_in}) +=
          d.t().mm(inputs[l].to(d.scalar_type()));
      gradient.narrow(0, layer.bias, layer.n_out) += d.sum(0, false, gradient.scalar_type());
      return d.mm(weight[l]).to(hidden_type);
    };
    // A ReLU passes on where its result, the last columns of the next layer's input, is above 0.
    const auto through_relu = [&](std::size_t next, const torch::Tensor& d, std::int64_t width) {
      const std::int64_t first = inputs[next].size(1) - width;
      return d.narrow(1, first, width) * (inputs[next].narrow(1, first, width) > 0);
    };
    const auto sigma = static_cast<std::size_t>(shape.depth), bottleneck = sigma + 1, towards = sigma + 2, s = sigma + 3;
    torch::Tensor d = through_relu(s, back(s, d_s.view({-1, 1})), shape.width / 2);
    d = back(bottleneck, back(towards, d).narrow(1, 0, shape.width));
    d += back(sigma, d_sigma.view({-1, 1}));
    for (std::size_t l = sigma; l-- > 0;) d = back(l, through_relu(l + 1, d, shape.width));
  }
};

struct TorchMlp : torch::autograd::Function<TorchMlp> {
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context, const torch::Tensor&,
                                                const c10::intrusive_ptr<TorchPass>& pass) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    std::vector<torch::Tensor> sigma, s;
    for (const torch::Tensor& some : torch::arange(pass->place.size(0)).split(kSamplesAtATime)) {
      const MlpOutput out = pass->evaluate(some, pass->keeps ? &pass->kept.emplace_back() : nullptr);
      sigma.push_back(out.sigma_raw);
      s.push_back(out.s_raw);
    }
    return {torch::cat(sigma), torch::cat(s)};
  }

  /// Inputs of layers that were not kept are computed again, for samples that have a gradient.
  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 const torch::autograd::variable_list& gradients) {
    const auto pass = c10::static_intrusive_pointer_cast<TorchPass>(context->saved_data["pass"].toCapsule());
    torch::Tensor gradient = torch::zeros({mlp_parameter_count(pass->shape)}, gradients[0].options());
    const torch::Tensor active = (gradients[0] != 0).logical_or(gradients[1] != 0);
    const std::int64_t n_samples = active.size(0);
    for (std::int64_t first = 0; first < n_samples; first += kSamplesAtATime) {
      const torch::Tensor mine = torch::nonzero(active.narrow(0, first, std::min(kSamplesAtATime, n_samples - first))).view(-1);
      if (mine.numel() == 0) continue;
      TorchPass::Inputs inputs;
      if (pass->keeps) {
        for (const torch::Tensor& all : pass->kept[static_cast<std::size_t>(first / kSamplesAtATime)])
          inputs.push_back(all.index_select(0, mine));
      } else {
        pass->evaluate(mine + first, &inputs);
      }
      pass->add_gradient(inputs, gradients[0].index_select(0, mine + first), gradients[1].index_select(0, mine + first), gradient);
    }
    return {gradient, {}};
  }
};

}  // namespace

MlpOutput mlp_forward_torch(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                            torch::ScalarType hidden_type, double most_kept_bytes) {
  const auto type = network.parameters.scalar_type();
  auto pass = c10::make_intrusive<TorchPass>();
  pass->hidden_type = hidden_type;
  pass->set_network(network);
  const glm::vec3 centre(network.box_m.centre()), inverse_half(2.0 / network.box_m.size());
  pass->place = (tensor_of(point_m, type) - tensor_of({&centre, 1}, type)) * tensor_of({&inverse_half, 1}, type);
  pass->direction = encode(tensor_of(ray_direction, type), network.shape.direction_frequencies);
  pass->ray = torch::empty({static_cast<std::int64_t>(point_m.size())}, torch::kLong);
  auto* ray = pass->ray.data_ptr<std::int64_t>();
  for (std::size_t q = 0; q + 1 < ray_begin.size(); ++q)
    std::fill(ray + ray_begin[q], ray + ray_begin[q + 1], static_cast<std::int64_t>(q));
  pass->keeps = torch::GradMode::is_enabled() && pass->bytes_of_sample() * static_cast<double>(point_m.size()) <= most_kept_bytes;
  const auto out = TorchMlp::apply(network.parameters, pass);
  return {out[0], out[1]};
}

namespace {

/// Activations that LibTorch keeps for a gradient, at most.
constexpr double kMostKept_bytes = 4e9;

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

namespace {

#ifdef SARNERF_MLP_KERNELS
bool has_avx512_bf16() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") &&
         __builtin_cpu_supports("avx512bf16");
}

/// Linux grants the tile registers, 8 KiB a thread in each signal frame, only to a process that requests them.
bool has_amx_bf16() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  constexpr unsigned kBf16 = 1u << 22, kTile = 1u << 24;
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(d & kBf16) || !(d & kTile)) return false;
  constexpr long kRequestPermission = 0x1023, kTileData = 18;
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}
#endif

}  // namespace

bool mlp_kernel_runs(MlpKernel kernel, [[maybe_unused]] const MlpShape& shape) {
  if (kernel == MlpKernel::plain) return true;
#ifdef SARNERF_MLP_KERNELS
  static const bool avx512 = has_avx512_bf16(), amx = avx512 && has_amx_bf16();
  return kernel == MlpKernel::amx_bf16 ? amx && fused_kernels_fit(shape) : avx512 && at::hasMKLDNN();
#else
  return false;
#endif
}

MlpKernel best_mlp_kernel(const MlpShape& shape) {
  for (const MlpKernel kernel : {MlpKernel::amx_bf16, MlpKernel::bf16})
    if (mlp_kernel_runs(kernel, shape)) return kernel;
  return MlpKernel::plain;
}

std::string_view name(MlpKernel kernel) {
  switch (kernel) {
    case MlpKernel::plain:
      return "plain";
    case MlpKernel::bf16:
      return "bf16";
    case MlpKernel::amx_bf16:
      return "amx-bf16";
  }
  return "unknown";
}

MlpOutput mlp_forward(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                      std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                      MlpKernel kernel) {
  check(network, point_m, ray_direction, ray_begin);
  const auto type = network.parameters.scalar_type();
  if (kernel == MlpKernel::plain) return mlp_forward_torch(network, point_m, ray_direction, ray_begin, type, kMostKept_bytes);
  if (type != torch::kFloat) {
    throw UsageError("network: kernel " + std::string(name(kernel)) + " expects parameters of type float32");
  }
  if (!mlp_kernel_runs(kernel, network.shape)) {
    throw UsageError("network: no " + std::string(name(kernel)) +
                     " kernel on this processor, in this build or for this shape; the best one is " +
                     std::string(name(best_mlp_kernel(network.shape))));
  }
  if (kernel == MlpKernel::bf16)
    return mlp_forward_torch(network, point_m, ray_direction, ray_begin, torch::kBFloat16, kMostKept_bytes);
#ifdef SARNERF_MLP_KERNELS
  return mlp_forward_fused(network, point_m, ray_direction, ray_begin, {mlp_amx::pack, mlp_amx::forward, mlp_amx::backward});
#else
  return {};  // not reached: such a build has no AMX kernel
#endif
}

MlpOutput mlp_forward(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                      std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin) {
  return mlp_forward(network, point_m, ray_direction, ray_begin, best_mlp_kernel(network.shape));
}

}  // namespace sarnerf
