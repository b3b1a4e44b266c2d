// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <immintrin.h>

/// Products of tiles by AVX512-BF16: the interface of mlp_tiles_amx.h, to test the passes on a processor without AMX.
namespace sarnerf {
namespace {

constexpr std::size_t kTileBytes = 1024;
constexpr std::size_t kTileFloats = 256;

/// Nothing to set up.
struct TileSession {
  TileSession() {}
};

struct TileRun {
  const char* tile[2];
  std::size_t stride;  ///< bytes from step to step
};

/// Rows of a left tile that are multiplied at a time: with two right tiles, sixteen sums in registers.
constexpr std::size_t kRows = 8;

using Sums = __m512[kRows][2];

/// Adds kRows rows of a left tile times two right tiles.
inline void multiply(const char* left, std::size_t left_stride, TileRun right, std::size_t steps, Sums& sum) {
  for (std::size_t k = 0; k < steps; ++k) {
    for (std::size_t pair = 0; pair < 16; ++pair) {
      const auto r0 = reinterpret_cast<__m512bh>(_mm512_load_si512(right.tile[0] + 64 * pair));
      const auto r1 = reinterpret_cast<__m512bh>(_mm512_load_si512(right.tile[1] + 64 * pair));
      for (std::size_t row = 0; row < kRows; ++row) {
        std::int32_t both;
        __builtin_memcpy(&both, left + 64 * row + 4 * pair, 4);
        const auto l = reinterpret_cast<__m512bh>(_mm512_set1_epi32(both));
        sum[row][0] = _mm512_dpbf16_ps(sum[row][0], l, r0);
        sum[row][1] = _mm512_dpbf16_ps(sum[row][1], l, r1);
      }
    }
    left += left_stride;
    for (const char*& tile : right.tile) tile += right.stride;
  }
}

template <class Work>
inline void product(const TileRun (&values)[2], const char* weights, const std::size_t (&steps)[2], float* c,
                    Work&& work) {
  const TileRun first{{weights, weights + kTileBytes}, 2 * kTileBytes};
  const char* second = weights + 2 * kTileBytes * steps[0];
  for (std::size_t tile = 0; tile < 2; ++tile) {
    for (std::size_t row = 0; row < 16; row += kRows) {
      Sums sum;
      for (auto& s : sum) s[0] = s[1] = _mm512_setzero_ps();
      multiply(values[0].tile[tile] + 64 * row, values[0].stride, first, steps[0], sum);
      if (steps[1] > 0) {
        multiply(values[1].tile[tile] + 64 * row, values[1].stride,
                 {{second, second + kTileBytes}, 2 * kTileBytes}, steps[1], sum);
      }
      for (std::size_t k = 0; k < kRows; ++k) {
        float* out = c + 2 * kTileFloats * tile + 16 * (row + k);
        _mm512_store_ps(out, sum[k][0]);
        _mm512_store_ps(out + kTileFloats, sum[k][1]);
      }
    }
  }
  for (std::size_t k = 0; k < steps[0] + steps[1]; ++k) work();
}

template <class Work>
inline void add_product(const char* transposed, const char* paired, std::size_t steps, float* c,
                        Work&& work) {
  for (std::size_t tile = 0; tile < 2; ++tile) {
    for (std::size_t row = 0; row < 16; row += kRows) {
      float* out = c + 2 * kTileFloats * tile + 16 * row;
      Sums sum;
      for (std::size_t k = 0; k < kRows; ++k) {
        sum[k][0] = _mm512_load_ps(out + 16 * k);
        sum[k][1] = _mm512_load_ps(out + kTileFloats + 16 * k);
      }
      multiply(transposed + kTileBytes * tile + 64 * row, 2 * kTileBytes,
               {{paired, paired + kTileBytes}, 2 * kTileBytes}, steps, sum);
      for (std::size_t k = 0; k < kRows; ++k) {
        _mm512_store_ps(out + 16 * k, sum[k][0]);
        _mm512_store_ps(out + kTileFloats + 16 * k, sum[k][1]);
      }
    }
  }
  for (std::size_t k = 0; k < steps; ++k) work();
}

}  // namespace
}  // namespace sarnerf
