// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlp_kernel.h"
#include "mlp_kernel_encode.h"

/// The forward pass of a block of samples. Included behind mlp_tiles_amx.h or mlp_tiles_avx512.h. Internal linkage:
/// see mlp_kernel.h.
namespace sarnerf {
namespace {

constexpr std::size_t kPanel = 16;  ///< samples of a tile of `values`

/// Bytes of `values` of one panel of 32 steps features.
inline std::size_t panel_bytes(std::size_t steps) { return kTileBytes * steps; }

/// Inputs of the layers of a block, as `values`: activations[l] is layer l's output.
struct MlpBlockValues {
  char* position;
  char* direction;
  char* activations[32];
};

inline const char* input_values(const MlpBlockValues& v, MlpInput input, std::size_t layer) {
  return input == MlpInput::position    ? v.position
         : input == MlpInput::direction ? v.direction
                                        : v.activations[layer - 1];
}

/// Two neighbouring panels of values as operand of a product.
inline TileRun panel_pair(const char* values, std::size_t panel, std::size_t steps) {
  const char* first = values + panel * panel_bytes(steps);
  return {{first, first + panel_bytes(steps)}, kTileBytes};
}

inline void encode_block(const MlpPlan& plan, const MlpSamples& samples, std::size_t begin, std::size_t n,
                         const MlpBlockValues& out) {
  for (std::size_t s = 0; s < n; s += kPanel) {
    __m512 position[3], direction[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const __m512 p = _mm512_loadu_ps(samples.point[axis] + begin + s);
      position[axis] = _mm512_mul_ps(_mm512_sub_ps(p, _mm512_set1_ps(plan.centre[axis])),
                                     _mm512_set1_ps(plan.inverse_half_size[axis]));
      direction[axis] = _mm512_loadu_ps(samples.direction[axis] + begin + s);
    }
    const std::size_t panel = s / kPanel;
    encode(position, plan.position_frequencies, plan.position_steps,
           out.position + panel * panel_bytes(plan.position_steps));
    encode(direction, plan.direction_frequencies, plan.direction_steps,
           out.direction + panel * panel_bytes(plan.direction_steps));
  }
}

/// What remains to be done with a product of 32 samples × 32 outputs: bias, ReLU, bf16, and the scalar product with a
/// head's weights. It is done in sixteen parts while the next product is under way.
template <bool kRelu, bool kHead>
struct ForwardFinish {
  const float* c;   ///< [2][2] tiles
  char* out[2];     ///< tiles of `values` of two panels
  __m512 bias[2];   ///< of 32 outputs
  __m512 head[2];   ///< weights of 32 outputs
  float* sum;       ///< [32 samples][16], added to
  std::size_t part = 16, parts_per_step = 1;

  void operator()() { advance(parts_per_step); }
  void finish() { advance(16); }

 private:
  void advance(std::size_t n) {
    for (; n > 0 && part < 16; --n, ++part) {
      for (std::size_t panel = 0; panel < 2; ++panel) {
        const float* p = c + 2 * kTileFloats * panel + 16 * part;
        __m512 first = _mm512_add_ps(_mm512_load_ps(p), bias[0]);
        __m512 second = _mm512_add_ps(_mm512_load_ps(p + kTileFloats), bias[1]);
        if constexpr (kHead) {
          first = _mm512_max_ps(first, _mm512_setzero_ps());
          second = _mm512_max_ps(second, _mm512_setzero_ps());
          float* s = sum + 16 * (kPanel * panel + part);
          const __m512 partial = _mm512_fmadd_ps(first, head[0], _mm512_load_ps(s));
          _mm512_store_ps(s, _mm512_fmadd_ps(second, head[1], partial));
        }
        __m512i v = to_bf16(first, second);
        // As integers, negative numbers of bf16 are negative too.
        if constexpr (kRelu && !kHead) v = _mm512_max_epi16(v, _mm512_setzero_si512());
        store(out[panel] + 64 * part, v);
      }
    }
  }
};

/// One layer of a block of n samples. Adds to `head_sums` [n][16] where a head reads this layer.
template <bool kRelu, bool kHead>
[[gnu::noinline]] void forward_layer(const MlpPlan& plan, std::size_t l, const float* parameters,
                                     const char* packed, const MlpBlockValues& values, std::size_t n,
                                     const float* head, float* head_sums) {
  const MlpKernelLayer& layer = plan.layers[l];
  const std::size_t all_steps = layer.steps[0] + layer.steps[1], pairs = layer.n_out / 32;
  alignas(64) float c[2][4 * kTileFloats];
  ForwardFinish<kRelu, kHead> finish{};
  finish.parts_per_step = (16 + all_steps - 1) / all_steps;
  std::size_t turn = 0;
  for (std::size_t panel = 0; panel < n / kPanel; panel += 2) {
    TileRun inputs[2] = {};
    for (std::size_t part = 0; part < 2 && layer.steps[part] > 0; ++part) {
      inputs[part] = panel_pair(input_values(values, layer.input[part], l), panel, layer.steps[part]);
    }
    const TileRun out = panel_pair(values.activations[l], panel, pairs);
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      product(inputs, packed + kTileBytes * (layer.packed + 2 * all_steps * pair), layer.steps, c[turn], finish);
      finish.finish();
      finish.c = c[turn];
      for (std::size_t q = 0; q < 2; ++q) {
        finish.out[q] = const_cast<char*>(out.tile[q]) + kTileBytes * pair;
        finish.bias[q] = _mm512_loadu_ps(parameters + layer.bias + 32 * pair + 16 * q);
        if constexpr (kHead) finish.head[q] = _mm512_loadu_ps(head + 32 * pair + 16 * q);
      }
      if constexpr (kHead) finish.sum = head_sums + 16 * kPanel * panel;
      finish.part = 0;
      turn ^= 1;
    }
  }
  finish.finish();
}

inline void clear(float* p, std::size_t n) {
  for (std::size_t k = 0; k < n; k += 16) _mm512_store_ps(p + k, _mm512_setzero_ps());
}

/// All layers of n samples from `begin` on; n is a multiple of 32 and at most kMlpBlock.
inline void forward_block(const MlpPlan& plan, const float* parameters, const char* packed,
                          const MlpSamples& samples, std::size_t begin, std::size_t n,
                          const MlpBlockValues& values, float* sigma, float* s) {
  alignas(64) float sums[16 * kMlpBlock];
  encode_block(plan, samples, begin, n, values);
  const auto with_head = [&](const MlpKernelHead& head, float* out) {
    clear(sums, 16 * n);
    forward_layer<true, true>(plan, head.layer, parameters, packed, values, n, parameters + head.weight, sums);
    for (std::size_t k = 0; k < n; ++k) {
      out[k] = parameters[head.bias] + _mm512_reduce_add_ps(_mm512_load_ps(sums + 16 * k));
    }
  };
  for (std::size_t l = 0; l < plan.n_layers; ++l) {
    if (l == plan.sigma.layer) {
      with_head(plan.sigma, sigma);
    } else if (l == plan.s.layer) {
      with_head(plan.s, s);
    } else if (l == plan.sigma.layer + 1) {
      forward_layer<false, false>(plan, l, parameters, packed, values, n, nullptr, nullptr);
    } else {
      forward_layer<true, false>(plan, l, parameters, packed, values, n, nullptr, nullptr);
    }
  }
}

}  // namespace
}  // namespace sarnerf
