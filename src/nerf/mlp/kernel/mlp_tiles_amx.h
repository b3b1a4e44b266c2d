// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <immintrin.h>

/// Products of tiles by AMX. Internal linkage: see mlp_kernel.h.
namespace sarnerf {
namespace {

constexpr std::size_t kTileBytes = 1024;
constexpr std::size_t kTileFloats = 256;

/// Configures all eight tile registers of a thread, 16 rows of 64 bytes each, for its lifetime.
class TileSession {
 public:
  TileSession() {
    struct alignas(64) {
      std::uint8_t palette = 1, start_row = 0, reserved[14] = {};
      std::uint16_t row_bytes[16] = {64, 64, 64, 64, 64, 64, 64, 64};
      std::uint8_t rows[16] = {16, 16, 16, 16, 16, 16, 16, 16};
    } config;
    // The intrinsics do not tell the compiler which memory they read.
    asm volatile("" ::"r"(&config) : "memory");
    _tile_loadconfig(&config);
  }
  ~TileSession() { _tile_release(); }
  TileSession(const TileSession&) = delete;
  TileSession& operator=(const TileSession&) = delete;
};

/// An operand, two tiles wide, that is read step by step.
struct TileRun {
  const char* tile[2];
  std::size_t stride;  ///< bytes from step to step
};

/// Adds left · right to registers 0…3, and calls work() once a step, which overlaps with the products. The left operand
/// should stay in the L1 cache for further products; the right one, read once, should not displace it.
template <class Work>
inline void multiply(TileRun left, TileRun right, std::size_t steps, Work&& work) {
#pragma GCC unroll 8
  for (std::size_t k = 0; k < steps; ++k) {
    _tile_stream_loadd(6, right.tile[0], 64);
    _tile_loadd(4, left.tile[0], 64);
    _tile_dpbf16ps(0, 4, 6);
    _tile_stream_loadd(7, right.tile[1], 64);
    _tile_dpbf16ps(1, 4, 7);
    _tile_loadd(5, left.tile[1], 64);
    _tile_dpbf16ps(2, 5, 6);
    _tile_dpbf16ps(3, 5, 7);
    for (std::size_t n = 0; n < 2; ++n) {
      left.tile[n] += left.stride;
      right.tile[n] += right.stride;
    }
    work();
  }
}

inline void store_products(float* c) {
  _tile_stored(0, c, 64);
  _tile_stored(1, c + kTileFloats, 64);
  _tile_stored(2, c + 2 * kTileFloats, 64);
  _tile_stored(3, c + 3 * kTileFloats, 64);
}

/// c[2][2] tiles of floats = values · weights, the values in two runs of steps.
template <class Work>
inline void product(const TileRun (&values)[2], const char* weights, const std::size_t (&steps)[2], float* c,
                    Work&& work) {
  asm volatile("" ::: "memory");
  _tile_zero(0);
  _tile_zero(1);
  _tile_zero(2);
  _tile_zero(3);
  for (std::size_t run = 0; run < 2; ++run) {
    multiply(values[run], {{weights, weights + kTileBytes}, 2 * kTileBytes}, steps[run], work);
    weights += 2 * kTileBytes * steps[run];
  }
  store_products(c);
}

/// c[2][2] += transposed[steps][2] · paired[steps][2].
template <class Work>
inline void add_product(const char* transposed, const char* paired, std::size_t steps, float* c,
                        Work&& work) {
  asm volatile("" ::: "memory");
  _tile_loadd(0, c, 64);
  _tile_loadd(1, c + kTileFloats, 64);
  _tile_loadd(2, c + 2 * kTileFloats, 64);
  _tile_loadd(3, c + 3 * kTileFloats, 64);
  multiply({{transposed, transposed + kTileBytes}, 2 * kTileBytes},
           {{paired, paired + kTileBytes}, 2 * kTileBytes}, steps, work);
  store_products(c);
}

}  // namespace
}  // namespace sarnerf
