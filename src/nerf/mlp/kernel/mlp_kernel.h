// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// The interface between mlp_fused.cpp and the kernels of the network. These are compiled for instruction sets that
/// this processor may not have, so the two sides share no inline function: the linker keeps one copy of each, and
/// it might keep the wrong one. Hence plain pointers, and no standard containers.
///
/// All matrices are divided into tiles of 1 KiB: 16 rows of 64 bytes. Four layouts of bf16 numbers:
///
///     values       [samples / 16][features / 32] tiles of 16 samples × 32 features
///     weights      [outputs / 32][inputs / 32][2] tiles of 16 rows: 2 inputs × 16 outputs, interleaved
///     transposed   [features / 32][samples / 32][2] tiles of 16 features × 32 samples
///     paired       [features / 32][samples / 32][2] tiles of 16 rows: 2 samples × 16 features, interleaved
///
/// A layer is values · weights; the gradient of its input is the same with the transposed matrix, that of its weights
/// transposed · paired. In the last two layouts the first tile has the even features and the second the odd ones, and
/// the samples of a step of 32 are in the order 0, 16, 1, 17, …, 15, 31.
namespace sarnerf {

/// Where a part of a layer's input comes from.
enum class MlpInput : std::uint8_t { none, position, direction, previous };

/// One layer of matrix form. Lengths are padded with zeros to multiples of 32.
struct MlpKernelLayer {
  std::size_t n_out;           ///< multiple of 32
  MlpInput input[2];           ///< parts of the input, in this order; the second may be `none`
  std::size_t n_in[2];         ///< their features, without padding
  std::size_t steps[2];        ///< their padded features / 32
  std::size_t weight;          ///< in the parameters: [n_out, n_in[0] + n_in[1]]
  std::size_t bias;            ///< in the parameters: [n_out]
  std::size_t packed;          ///< first tile of the weights among the packed ones
  std::size_t packed_previous; ///< first tile of the transpose, the part of `previous` only; none in layer 0
  std::size_t sum;             ///< first float of ∂L/∂weights among the sums: [Σ steps][n_out / 32][2][2] tiles
  std::size_t bias_sum;        ///< first float of ∂L/∂bias among the sums: [n_out / 32][2][16]
};

/// One output σ_r or S_r: a row of weights and a bias for the values of a layer.
struct MlpKernelHead {
  std::size_t layer;
  std::size_t weight, bias;  ///< in the parameters
  std::size_t sum;           ///< among the sums: [n_in / 32][2][16] of the weights, then [16] partial sums of the bias
};

/// Layers: the trunk, the bottleneck (no ReLU), the layer that takes the direction.
struct MlpPlan {
  const MlpKernelLayer* layers;
  std::size_t n_layers;
  MlpKernelHead sigma, s;
  std::size_t position_frequencies, direction_frequencies;
  std::size_t position_steps, direction_steps;  ///< padded features / 32
  std::size_t width_steps;                      ///< largest n_out / 32
  std::size_t n_tiles;                          ///< of packed weights
  std::size_t n_sums;                           ///< floats
  float centre[3], inverse_half_size[3];        ///< of the box that is mapped to [−1, 1]³
};

/// Samples of one call, padded with any finite values to a multiple of 32.
struct MlpSamples {
  std::size_t n;          ///< multiple of 32
  const float* point[3];  ///< [n] each
  const float* direction[3];
};

/// Samples that the forward pass takes at a time: their activations stay in the L1 cache, while all weights are
/// streamed from the L2 cache.
inline constexpr std::size_t kMlpBlock = 32;

/// Maximum number of samples of a call of the backward pass. With few samples, reading and writing the sums costs as much
/// as the samples themselves; with many, their activations leave the cache.
inline constexpr std::size_t kMlpChunk = 1024;

/// Samples over which products for the gradient of weights are summed in registers: one operand of such a product fits
/// into the L1 cache.
inline constexpr std::size_t kMlpRun = 256;

/// Bytes of scratch space that forward() and backward() need, to be aligned to 64.
std::size_t mlp_forward_scratch(const MlpPlan& plan);
std::size_t mlp_backward_scratch(const MlpPlan& plan);

#define SARNERF_MLP_KERNEL(set)                                                                  \
  namespace set {                                                                                \
  /** Packs layers [begin, end) into 1 KiB tiles. */                                             \
  void pack(const MlpPlan& plan, const float* parameters, std::size_t begin, std::size_t end,    \
            char* packed);                                                                       \
  /** σ_r and S_r [n]. */                                                                        \
  void forward(const MlpPlan& plan, const float* parameters, const char* packed,                 \
               const MlpSamples& samples, char* scratch, float* sigma, float* s);                \
  /** Adds to sums [n_sums], aligned to 64; n ≤ kMlpChunk. */                                    \
  void backward(const MlpPlan& plan, const float* parameters, const char* packed,                \
                const MlpSamples& samples, const float* sigma_gradient, const float* s_gradient, \
                char* scratch, float* sums);                                                     \
  }
SARNERF_MLP_KERNEL(mlp_amx)
SARNERF_MLP_KERNEL(mlp_emulated)  // of the tests
#undef SARNERF_MLP_KERNEL

}  // namespace sarnerf
