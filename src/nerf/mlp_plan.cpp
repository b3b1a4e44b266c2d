// SPDX-License-Identifier: Apache-2.0
#include "mlp_plan.h"

#include <algorithm>

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
         shape.direction_frequencies <= 12;
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

}  // namespace sarnerf
