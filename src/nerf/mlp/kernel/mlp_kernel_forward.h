// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <immintrin.h>

#include "mlp/kernel/mlp_kernel.h"

/// Conversions between the layouts of mlp_kernel.h, a vector at a time. Internal linkage: see there.
namespace sarnerf {
namespace {

inline __m512i load(const char* p) { return _mm512_load_si512(p); }
inline void store(char* p, __m512i v) { _mm512_store_si512(p, v); }

/// Row of `values`, from the first 16 features and the other 16.
inline __m512i to_bf16(__m512 first, __m512 second) {
  return reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(second, first));
}

/// The even and the odd features of a row of `values` as floats.
inline __m512 even_features(__m512i row) {
  return _mm512_castsi512_ps(_mm512_slli_epi32(row, 16));
}
inline __m512 odd_features(__m512i row) {
  return _mm512_castsi512_ps(_mm512_and_si512(row, _mm512_set1_epi32(-0x10000)));
}

/// Rows of `paired` from the rows of two samples.
inline __m512i even_pairs(__m512i first, __m512i second) {
  return _mm512_mask_blend_epi16(0xaaaaaaaau, first, _mm512_slli_epi32(second, 16));
}
inline __m512i odd_pairs(__m512i first, __m512i second) {
  return _mm512_mask_blend_epi16(0xaaaaaaaau, _mm512_srli_epi32(first, 16), second);
}

/// Transposes 16 rows of 16 words of 32 bits.
inline void transpose(__m512i (&r)[16]) {
  __m512i t[16];
  for (std::size_t n = 0; n < 16; n += 2) {
    t[n] = _mm512_unpacklo_epi32(r[n], r[n + 1]);
    t[n + 1] = _mm512_unpackhi_epi32(r[n], r[n + 1]);
  }
  for (std::size_t n = 0; n < 16; n += 4) {
    r[n] = _mm512_unpacklo_epi64(t[n], t[n + 2]);
    r[n + 1] = _mm512_unpackhi_epi64(t[n], t[n + 2]);
    r[n + 2] = _mm512_unpacklo_epi64(t[n + 1], t[n + 3]);
    r[n + 3] = _mm512_unpackhi_epi64(t[n + 1], t[n + 3]);
  }
  for (std::size_t n = 0; n < 4; ++n) {
    t[n] = _mm512_shuffle_i32x4(r[n], r[n + 4], 0x88);
    t[n + 4] = _mm512_shuffle_i32x4(r[n], r[n + 4], 0xdd);
    t[n + 8] = _mm512_shuffle_i32x4(r[n + 8], r[n + 12], 0x88);
    t[n + 12] = _mm512_shuffle_i32x4(r[n + 8], r[n + 12], 0xdd);
  }
  for (std::size_t n = 0; n < 4; ++n) {
    r[n] = _mm512_shuffle_i32x4(t[n], t[n + 8], 0x88);
    r[n + 4] = _mm512_shuffle_i32x4(t[n + 4], t[n + 12], 0x88);
    r[n + 8] = _mm512_shuffle_i32x4(t[n], t[n + 8], 0xdd);
    r[n + 12] = _mm512_shuffle_i32x4(t[n + 4], t[n + 12], 0xdd);
  }
}

/// Tile of `transposed`, of even or odd features, from one tile of `values` of each of two panels of 16 samples.
template <bool kOdd>
inline void transpose_tile(const char* first, const char* second, char* tile) {
  __m512i r[16];
  for (std::size_t n = 0; n < 16; ++n) {
    const __m512i a = load(first + 64 * n), b = load(second + 64 * n);
    r[n] = kOdd ? odd_pairs(a, b) : even_pairs(a, b);
  }
  transpose(r);
  for (std::size_t n = 0; n < 16; ++n) store(tile + 64 * n, r[n]);
}

}  // namespace
}  // namespace sarnerf

/// Positional encoding (printed eq. 27) of 16 samples at a time. Internal linkage: see mlp_kernel.h.
namespace sarnerf {
namespace {

/// sin πx and cos πx, absolute error 1e-6, for |x| < 1e6.
inline void sine_cosine(__m512 x, __m512& sine, __m512& cosine) {
  const __m512 n = _mm512_roundscale_ps(x, 0);
  const __m512 r = _mm512_sub_ps(x, n);  // exact, |r| ≤ ½
  const __m512 y = _mm512_mul_ps(r, r);
  // Taylor's series in πr, whose terms beyond these are less than 5e-8.
  __m512 p = _mm512_set1_ps(-0.0073704309f);
  p = _mm512_fmadd_ps(p, y, _mm512_set1_ps(0.082145887f));
  p = _mm512_fmadd_ps(p, y, _mm512_set1_ps(-0.59926453f));
  p = _mm512_fmadd_ps(p, y, _mm512_set1_ps(2.5501640f));
  p = _mm512_fmadd_ps(p, y, _mm512_set1_ps(-5.1677128f));
  p = _mm512_fmadd_ps(p, y, _mm512_set1_ps(3.1415927f));
  p = _mm512_mul_ps(p, r);
  __m512 q = _mm512_set1_ps(0.0019295743f);
  q = _mm512_fmadd_ps(q, y, _mm512_set1_ps(-0.025806891f));
  q = _mm512_fmadd_ps(q, y, _mm512_set1_ps(0.23533063f));
  q = _mm512_fmadd_ps(q, y, _mm512_set1_ps(-1.3352628f));
  q = _mm512_fmadd_ps(q, y, _mm512_set1_ps(4.0587121f));
  q = _mm512_fmadd_ps(q, y, _mm512_set1_ps(-4.9348022f));
  q = _mm512_fmadd_ps(q, y, _mm512_set1_ps(1.0f));
  // Odd n flips both signs.
  const __m512i sign = _mm512_slli_epi32(_mm512_cvtps_epi32(n), 31);
  sine = _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(p), sign));
  cosine = _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(q), sign));
}

/// Panel of `values`: x of the three axes, then for l = 0, 1, … sin 2ˡπx of the three and cos 2ˡπx of the three.
/// Each doubling of the angle doubles the error, which begins at 1e-7: 1e-4 for L = 10, where bf16 rounds by 2e-3.
inline void encode(const __m512 (&axis)[3], std::size_t n_frequencies, std::size_t steps, char* panel) {
  alignas(64) float feature[128][16];
  __m512 sine[3], cosine[3];
  for (std::size_t n = 0; n < 3; ++n) {
    _mm512_store_ps(feature[n], axis[n]);
    sine_cosine(axis[n], sine[n], cosine[n]);
  }
  std::size_t f = 3;
  for (std::size_t l = 0; l < n_frequencies; ++l, f += 6) {
    for (std::size_t n = 0; n < 3; ++n) {
      _mm512_store_ps(feature[f + n], sine[n]);
      _mm512_store_ps(feature[f + 3 + n], cosine[n]);
      const __m512 twice = _mm512_add_ps(sine[n], sine[n]);
      cosine[n] = _mm512_fnmadd_ps(twice, sine[n], _mm512_set1_ps(1.0f));
      sine[n] = _mm512_mul_ps(twice, _mm512_load_ps(feature[f + 3 + n]));
    }
  }
  for (; f < 32 * steps; ++f) _mm512_store_ps(feature[f], _mm512_setzero_ps());
  const __m512i order = _mm512_set_epi16(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8, 23, 7, 22,
                                         6, 21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
  for (std::size_t step = 0; step < steps; ++step) {
    __m512i r[16];  // pairs of features of 16 samples
    for (std::size_t n = 0; n < 16; ++n) {
      const float* even = feature[32 * step + 2 * n];
      r[n] = _mm512_permutexvar_epi16(order, to_bf16(_mm512_load_ps(even), _mm512_load_ps(even + 16)));
    }
    transpose(r);
    for (std::size_t n = 0; n < 16; ++n) store(panel + 1024 * step + 64 * n, r[n]);
  }
}

}  // namespace
}  // namespace sarnerf

/// Weights as tiles of bf16. Internal linkage: see mlp_kernel.h.
namespace sarnerf {
namespace {

inline __mmask16 first_lanes(std::size_t n) {
  return static_cast<__mmask16>(n >= 16 ? 0xffffu : (1u << n) - 1u);
}

/// Sixteen rows of 32 numbers of a row-major matrix to bf16, with zeros from column `n` on.
inline void load_block(const float* p, std::size_t stride, std::size_t n, __m512i (&row)[16]) {
  const __mmask16 low = first_lanes(n), high = first_lanes(n > 16 ? n - 16 : 0);
  for (std::size_t r = 0; r < 16; ++r, p += stride) {
    row[r] = to_bf16(_mm512_maskz_loadu_ps(low, p), _mm512_maskz_loadu_ps(high, p + 16));
  }
}

/// Packs columns [0, n_in) of a matrix W [n_out, stride] in the layout `weights`, into steps from `begin` on of `all_steps`.
inline void pack_weights(const float* weight, std::size_t stride, std::size_t n_out, std::size_t n_in,
                         std::size_t begin, std::size_t all_steps, char* tiles) {
  for (std::size_t out = 0; out < n_out; out += 16) {
    for (std::size_t in = 0; in < n_in; in += 32) {
      __m512i row[16];
      load_block(weight + out * stride + in, stride, n_in - in, row);
      transpose(row);  // a word is two inputs of one output
      char* tile = tiles + 1024 * (2 * (out / 32 * all_steps + begin + in / 32) + out / 16 % 2);
      for (std::size_t r = 0; r < 16; ++r) store(tile + 64 * r, row[r]);
    }
  }
}

/// The same of Wᵀ: rows of a tile are two outputs × 16 inputs. n_in is a multiple of 32.
inline void pack_transpose(const float* weight, std::size_t stride, std::size_t n_out, std::size_t n_in,
                           char* tiles) {
  const __m512i low = _mm512_set_epi16(47, 15, 46, 14, 45, 13, 44, 12, 43, 11, 42, 10, 41, 9, 40, 8, 39, 7, 38, 6,
                                       37, 5, 36, 4, 35, 3, 34, 2, 33, 1, 32, 0);
  const __m512i high = _mm512_add_epi16(low, _mm512_set1_epi16(16));
  for (std::size_t out = 0; out < n_out; out += 16) {
    for (std::size_t in = 0; in < n_in; in += 32) {
      __m512i row[16];
      load_block(weight + out * stride + in, stride, 32, row);
      char* tile = tiles + 1024 * 2 * (in / 32 * (n_out / 32) + out / 32);
      for (std::size_t r = 0; r < 16; r += 2) {
        char* to = tile + 64 * (out % 32 + r) / 2;
        store(to, _mm512_permutex2var_epi16(row[r], low, row[r + 1]));
        store(to + 1024, _mm512_permutex2var_epi16(row[r], high, row[r + 1]));
      }
    }
  }
}

inline void pack_layer(const MlpKernelLayer& layer, const float* parameters, char* packed) {
  const std::size_t stride = layer.n_in[0] + layer.n_in[1];
  const std::size_t all_steps = layer.steps[0] + layer.steps[1];
  const float* weight = parameters + layer.weight;
  for (std::size_t part = 0, step = 0; part < 2; ++part) {
    pack_weights(weight, stride, layer.n_out, layer.n_in[part], step, all_steps, packed + 1024 * layer.packed);
    if (layer.input[part] == MlpInput::previous) {
      pack_transpose(weight, stride, layer.n_out, layer.n_in[part], packed + 1024 * layer.packed_previous);
    }
    weight += layer.n_in[part];
    step += layer.steps[part];
  }
}

}  // namespace
}  // namespace sarnerf

/// The forward pass of a block of samples. Included after mlp_tiles_amx.h. Internal linkage:
/// see mlp_kernel.h.
namespace sarnerf {
namespace {

constexpr std::size_t kPanel = 16;  ///< samples of a tile of `values`

/// Bytes of one panel of `values` with 32 · steps features.
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

/// Completes a product of 32 samples × 32 outputs: bias, ReLU, conversion to bf16, and the scalar product with a head's
/// weights. This is done in sixteen parts while the next product is being computed.
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
