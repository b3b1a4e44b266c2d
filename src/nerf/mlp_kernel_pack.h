// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mlp_kernel.h"
#include "mlp_kernel_layout.h"

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

/// Layout `weights` of a matrix W [n_out, stride], its columns [0, n_in), to the steps from `begin` on of `all_steps`.
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
