// SPDX-License-Identifier: Apache-2.0
// The fused kernels: plan and autograd function.
#include <algorithm>
#include <new>

#include <torch/csrc/autograd/custom_function.h>

#include "mlp/kernel/mlp_plan.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {

namespace {

constexpr std::size_t kTileFloats = 256;

std::size_t steps_of(std::size_t n_features) { return (n_features + 31) / 32; }

std::size_t size(std::int64_t n) { return static_cast<std::size_t>(n); }

/// Adds up sums [n / 32][2][16], even features first.
void add_up_features(const std::vector<const float*>& sums, std::size_t at, std::size_t n, float* out) {
  for (std::size_t f = 0; f < n; ++f) {
    out[f] = 0.0f;
    for (const float* s : sums) out[f] += s[at + f / 32 * 32 + 16 * (f % 2) + f % 32 / 2];
  }
}

/// Bytes of `values` of n samples.
std::size_t values_bytes(std::size_t n_samples, std::size_t steps) { return n_samples * steps * 64; }

}  // namespace

bool fused_kernels_fit(const MlpShape& shape) {
  return shape.width % 64 == 0 && shape.width <= 512 && shape.depth <= 16 && shape.position_frequencies <= 12 &&
         shape.direction_frequencies >= 0 && shape.direction_frequencies <= 12;
}

MlpPlanOwner::MlpPlanOwner(const MlpShape& shape, const Box& box_m) {
  const auto n_position = size(encoded_size(shape.position_frequencies));
  const auto n_direction = size(encoded_size(shape.direction_frequencies));
  plan_.position_frequencies = size(shape.position_frequencies);
  plan_.direction_frequencies = size(shape.direction_frequencies);
  plan_.position_steps = steps_of(n_position);
  plan_.direction_steps = steps_of(n_direction);
  plan_.width_steps = std::max({size(shape.width) / 32, plan_.position_steps, plan_.direction_steps});
  const glm::vec3 centre(box_m.centre()), inverse_half(2.0 / box_m.size());
  for (int axis = 0; axis < 3; ++axis) {
    plan_.centre[axis] = centre[axis];
    plan_.inverse_half_size[axis] = inverse_half[axis];
  }

  for (const MlpLayer& source : mlp_layers(shape)) {
    const std::size_t l = layers_.size();
    if (source.n_out == 1) {
      MlpKernelHead& head = source.name == "sigma" ? plan_.sigma : plan_.s;
      head = {l - 1, size(source.weight), size(source.bias), plan_.n_sums};
      plan_.n_sums += size(source.n_in) + 16;
      continue;
    }
    MlpKernelLayer layer{};
    layer.n_out = size(source.n_out);
    layer.weight = size(source.weight);
    layer.bias = size(source.bias);
    std::size_t n_parts = 0;
    const auto add = [&](MlpInput input, std::size_t n) {
      layer.input[n_parts] = input;
      layer.n_in[n_parts] = n;
      layer.steps[n_parts++] = steps_of(n);
    };
    const bool in_trunk = source.name == "trunk";
    if (in_trunk && (l == 0 || size(source.n_in) > size(shape.width))) add(MlpInput::position, n_position);
    if (l > 0) add(MlpInput::previous, size(shape.width));
    if (source.name == "direction") add(MlpInput::direction, n_direction);

    const std::size_t all_steps = layer.steps[0] + layer.steps[1], out_steps = layer.n_out / 32;
    layer.packed = plan_.n_tiles;
    plan_.n_tiles += 2 * out_steps * all_steps;
    layer.packed_previous = plan_.n_tiles;
    if (l > 0) plan_.n_tiles += 2 * out_steps * size(shape.width) / 32;
    layer.sum = plan_.n_sums;
    plan_.n_sums += 4 * kTileFloats * out_steps * all_steps;
    layer.bias_sum = plan_.n_sums;
    plan_.n_sums += layer.n_out;
    layers_.push_back(layer);
  }
  plan_.layers = layers_.data();
  plan_.n_layers = layers_.size();
}

void MlpPlanOwner::gradient_of_layer(std::size_t l, const std::vector<const float*>& sums,
                                     float* gradient) const {
  const MlpKernelLayer& layer = layers_[l];
  const std::size_t n_in = layer.n_in[0] + layer.n_in[1], pairs = layer.n_out / 32;
  for (std::size_t part = 0, first_step = 0, first_column = 0; part < 2; ++part) {
    for (std::size_t block = 0; block < layer.steps[part] * pairs; ++block) {
      const std::size_t column = 32 * (block / pairs), row = 32 * (block % pairs);
      const std::size_t n = std::min<std::size_t>(32, layer.n_in[part] - column);
      std::array<float, 4 * kTileFloats> total{};  // [parity of input][of output][input / 2][output / 2]
      for (const float* s : sums) {
        const float* from = s + layer.sum + total.size() * (first_step * pairs + block);
        for (std::size_t k = 0; k < total.size(); ++k) total[k] += from[k];
      }
      for (std::size_t r = 0; r < 32; ++r) {
        float* out = gradient + layer.weight + (row + r) * n_in + first_column + column;
        const float* from = total.data() + kTileFloats * (r % 2) + r / 2;
        for (std::size_t c = 0; c < n; ++c) out[c] = from[2 * kTileFloats * (c % 2) + 16 * (c / 2)];
      }
    }
    first_step += layer.steps[part];
    first_column += layer.n_in[part];
  }
  add_up_features(sums, layer.bias_sum, layer.n_out, gradient + layer.bias);
}

void MlpPlanOwner::gradient_of_heads(const std::vector<const float*>& sums, float* gradient) const {
  for (const MlpKernelHead* head : {&plan_.sigma, &plan_.s}) {
    const std::size_t n_in = layers_[head->layer].n_out;
    add_up_features(sums, head->sum, n_in, gradient + head->weight);
    float total = 0.0f;
    for (const float* s : sums)
      for (std::size_t k = 0; k < 16; ++k) total += s[head->sum + n_in + k];
    gradient[head->bias] = total;
  }
}

std::size_t mlp_forward_scratch(const MlpPlan& plan) {
  return values_bytes(kMlpBlock, plan.position_steps + plan.direction_steps + 2 * plan.width_steps);
}

std::size_t mlp_backward_scratch(const MlpPlan& plan) {
  std::size_t steps = plan.position_steps + plan.direction_steps;
  for (std::size_t l = 0; l < plan.n_layers; ++l) steps += plan.layers[l].n_out / 32;
  constexpr std::size_t kRunBuffers = 2 * (kMlpChunk / kMlpRun + 1);
  return values_bytes(kMlpChunk, steps) + kRunBuffers * values_bytes(kMlpRun, plan.width_steps) +
         2 * values_bytes(kMlpRun, 1) + 2 * kMlpBlock * sizeof(float);
}

namespace {

/// Memory aligned to cache lines, not initialised.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(std::size_t n) : data_(static_cast<T*>(::operator new(n * sizeof(T), kAlignment))) {}
  T* get() const { return data_.get(); }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Delete {
    void operator()(T* p) const { ::operator delete(p, kAlignment); }
  };
  std::unique_ptr<T, Delete> data_;
};

/// Points and directions of samples, one array for each component.
class Samples {
 public:
  explicit Samples(std::size_t n) : stride_((n + 31) / 32 * 32), values_(6 * stride_) {}

  float* component(std::size_t c) const { return values_.get() + c * stride_; }
  void set(std::size_t at, const glm::vec3& point_m, const glm::vec3& direction) const {
    for (int axis = 0; axis < 3; ++axis) {
      component(static_cast<std::size_t>(axis))[at] = point_m[axis];
      component(static_cast<std::size_t>(axis) + 3)[at] = direction[axis];
    }
  }
  void copy(std::size_t at, const Samples& from, std::size_t index) const {
    for (std::size_t c = 0; c < 6; ++c) component(c)[at] = from.component(c)[index];
  }
  /// Fills [begin, end) with zeros, which are valid samples.
  void pad(std::size_t begin, std::size_t end) const {
    for (std::size_t c = 0; c < 6; ++c) std::fill(component(c) + begin, component(c) + end, 0.0f);
  }
  MlpSamples view(std::size_t begin, std::size_t n) const {
    MlpSamples v{n, {}, {}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      v.point[axis] = component(axis) + begin;
      v.direction[axis] = component(axis + 3) + begin;
    }
    return v;
  }

 private:
  std::size_t stride_;
  Buffer<float> values_;
};

std::size_t padded(std::size_t n) { return (n + 31) / 32 * 32; }

/// State of the forward pass that the backward pass needs.
struct Pass : torch::CustomClassHolder {
  Pass(const MlpNetwork& network, std::size_t n_samples, const MlpKernelFunctions& kernel)
      : owner(network.shape, network.box_m), functions(kernel), n(n_samples),
        packed(1024 * owner.plan().n_tiles), samples(n_samples) {}

  MlpPlanOwner owner;
  MlpKernelFunctions functions;
  std::size_t n;
  Buffer<char> packed;
  Samples samples;
};

void pack(const Pass& pass, const float* parameters) {
  parallel_for(pass.owner.plan().n_layers, 1, [&](std::size_t begin, std::size_t end, int) {
    pass.functions.pack(pass.owner.plan(), parameters, begin, end, pass.packed.get());
  });
}

/// Outputs of all samples; their points and directions are kept for the backward pass.
void forward(const Pass& pass, const float* parameters, std::span<const glm::vec3> point_m,
             std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin, float* sigma,
             float* s) {
  constexpr std::size_t kGrain = 1024;
  struct Worker {
    Buffer<char> scratch;
    alignas(64) float sigma[kGrain], s[kGrain];
  };
  const MlpPlan& plan = pass.owner.plan();
  std::vector<std::unique_ptr<Worker>> workers(static_cast<std::size_t>(thread_count()));
  // Chunks are multiples of what the kernels take at a time, however the parallel loop would divide the samples.
  parallel_for((pass.n + kGrain - 1) / kGrain, 1, [&](std::size_t chunk, std::size_t, int w) {
    const std::size_t begin = chunk * kGrain, end = std::min(pass.n, begin + kGrain);
    std::unique_ptr<Worker>& worker = workers[static_cast<std::size_t>(w)];
    if (!worker) {
      worker = std::make_unique<Worker>();
      worker->scratch = Buffer<char>(mlp_forward_scratch(plan));
    }
    // The last ray that begins at `begin` or before it: the sample belongs to it.
    auto ray = static_cast<std::size_t>(
        std::upper_bound(ray_begin.begin(), ray_begin.end(), static_cast<std::uint32_t>(begin)) -
        ray_begin.begin() - 1);
    for (std::size_t n = begin; n < end; ++n) {
      while (ray_begin[ray + 1] <= n) ++ray;
      pass.samples.set(n, point_m[n], ray_direction[ray]);
    }
    const std::size_t n_padded = padded(end - begin);
    pass.samples.pad(end, begin + n_padded);
    pass.functions.forward(plan, parameters, pass.packed.get(), pass.samples.view(begin, n_padded),
                           worker->scratch.get(), worker->sigma, worker->s);
    std::copy_n(worker->sigma, end - begin, sigma + begin);
    std::copy_n(worker->s, end - begin, s + begin);
  });
}

/// Samples without a gradient, in empty space or behind opaque material, are skipped. The others are distributed among the
/// threads in parts that depend only on the numbers of samples and threads; sums are added in the order of the parts.
///
/// They are evaluated again. Keeping the activations instead (5 KiB a sample) would save a third of the time here and cost a tenth of it for
/// every sample in the forward pass: a loss where fewer than 28 % of them have a gradient (measured with a former kernel for AVX512-BF16).
void backward(const Pass& pass, const float* parameters, const float* sigma_gradient, const float* s_gradient,
              float* gradient) {
  const MlpPlan& plan = pass.owner.plan();
  std::vector<std::uint32_t> active;
  for (std::size_t n = 0; n < pass.n; ++n)
    if (sigma_gradient[n] != 0.0f || s_gradient[n] != 0.0f) active.push_back(static_cast<std::uint32_t>(n));

  const std::size_t n_parts = std::clamp<std::size_t>((active.size() + kMlpRun - 1) / kMlpRun, 1,
                                                      static_cast<std::size_t>(thread_count()));
  const std::size_t per_part = padded((active.size() + n_parts - 1) / n_parts);
  std::vector<Buffer<float>> sums(n_parts);
  parallel_for(n_parts, 1, [&](std::size_t part, std::size_t, int) {
    sums[part] = Buffer<float>(plan.n_sums);
    std::fill_n(sums[part].get(), plan.n_sums, 0.0f);
    const Buffer<char> scratch(mlp_backward_scratch(plan));
    const Samples chunk(kMlpChunk);
    const Buffer<float> gradients(2 * kMlpChunk);
    float* g_sigma = gradients.get();
    float* g_s = g_sigma + kMlpChunk;
    const std::size_t end = std::min(active.size(), (part + 1) * per_part);
    for (std::size_t begin = std::min(end, part * per_part), n; begin < end; begin += n) {
      n = std::min(kMlpChunk, end - begin);
      for (std::size_t k = 0; k < n; ++k) {
        const std::uint32_t sample = active[begin + k];
        chunk.copy(k, pass.samples, sample);
        g_sigma[k] = sigma_gradient[sample];
        g_s[k] = s_gradient[sample];
      }
      const std::size_t n_padded = padded(n);
      chunk.pad(n, n_padded);
      std::fill(g_sigma + n, g_sigma + n_padded, 0.0f);
      std::fill(g_s + n, g_s + n_padded, 0.0f);
      pass.functions.backward(plan, parameters, pass.packed.get(), chunk.view(0, n_padded), g_sigma, g_s,
                              scratch.get(), sums[part].get());
    }
  });

  std::vector<const float*> all;
  for (const Buffer<float>& s : sums) all.push_back(s.get());
  parallel_for(plan.n_layers, 1, [&](std::size_t layer, std::size_t, int) {
    pass.owner.gradient_of_layer(layer, all, gradient);
  });
  pass.owner.gradient_of_heads(all, gradient);
}

struct FusedMlp : torch::autograd::Function<FusedMlp> {
  static torch::autograd::variable_list forward(torch::autograd::AutogradContext* context,
                                                const torch::Tensor& parameters,
                                                const c10::intrusive_ptr<Pass>& pass,
                                                std::span<const glm::vec3> point_m,
                                                std::span<const glm::vec3> ray_direction,
                                                std::span<const std::uint32_t> ray_begin) {
    context->saved_data["pass"] = torch::IValue::make_capsule(pass);
    context->save_for_backward({parameters});
    const auto n = static_cast<std::int64_t>(pass->n);
    torch::Tensor sigma = torch::empty({n}, torch::kFloat), s = torch::empty({n}, torch::kFloat);
    const auto* p = parameters.data_ptr<float>();
    pack(*pass, p);
    sarnerf::forward(*pass, p, point_m, ray_direction, ray_begin, sigma.data_ptr<float>(), s.data_ptr<float>());
    return {sigma, s};
  }

  static torch::autograd::variable_list backward(torch::autograd::AutogradContext* context,
                                                 torch::autograd::variable_list gradients) {
    const auto pass = c10::static_intrusive_pointer_cast<Pass>(context->saved_data["pass"].toCapsule());
    const torch::Tensor parameters = context->get_saved_variables()[0];
    const torch::Tensor sigma = gradients[0].contiguous(), s = gradients[1].contiguous();
    torch::Tensor gradient = torch::empty_like(parameters);
    sarnerf::backward(*pass, parameters.data_ptr<float>(), sigma.data_ptr<float>(), s.data_ptr<float>(),
                      gradient.data_ptr<float>());
    return {gradient, {}, {}, {}, {}};
  }
};

}  // namespace

MlpOutput mlp_forward_fused(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                            const MlpKernelFunctions& kernel) {
  auto pass = c10::make_intrusive<Pass>(network, point_m.size(), kernel);
  const auto out = FusedMlp::apply(network.parameters, pass, point_m, ray_direction, ray_begin);
  return {out[0], out[1]};
}

}  // namespace sarnerf
