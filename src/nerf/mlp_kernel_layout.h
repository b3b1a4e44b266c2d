// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <immintrin.h>

#include <cstddef>

/// Changes between the layouts of mlp_kernel.h, a vector at a time. Internal linkage: see there.
namespace sarnerf {
namespace {

inline __m512i load(const char* p) { return _mm512_load_si512(p); }
inline void store(char* p, __m512i v) { _mm512_store_si512(p, v); }

/// Row of `values`: the first 16 features and the others.
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
