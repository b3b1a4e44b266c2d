// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "mlp_kernel_layout.h"

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
  // Odd n turns both signs.
  const __m512i sign = _mm512_slli_epi32(_mm512_cvtps_epi32(n), 31);
  sine = _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(p), sign));
  cosine = _mm512_castsi512_ps(_mm512_xor_si512(_mm512_castps_si512(q), sign));
}

/// Panel of `values`: for each axis x itself, then sin 2ˡπx of the three and cos 2ˡπx of the three for l = 0, 1, …
/// Each doubling of the angle doubles the error, from 1e-7 on: 1e-4 for L = 10, where bf16 rounds by 2e-3.
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
