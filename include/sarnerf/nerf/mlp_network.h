// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>
#include <torch/types.h>

#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// Sizes of the network of SAR-NeRF. The defaults are those of its authors' code (the paper gives none): 595,586
/// parameters.
///
///     encoded position ─► trunk: depth × width, ReLU ─┬─► sigma (1)
///                                                     └─► bottleneck: width
///     bottleneck, encoded direction ─► direction: width / 2, ReLU ─► s (1)
///
/// Layer skip + 1 of the trunk takes the encoded position again, followed by the output of layer `skip`. The layer
/// `direction` takes the bottleneck's output, followed by the encoded direction.
struct MlpShape {
  int depth = 8;    ///< ≥ 1
  int width = 256;  ///< even, ≥ 2
  int skip = 4;     ///< 0-based; negative for none, else less than depth − 1
  int position_frequencies = 10;  ///< L of eq. 27 for the position, ≥ 0
  int direction_frequencies = 4;  ///< the same for the direction; −1: S does not depend on it

  bool operator==(const MlpShape&) const = default;
};

/// One affine map y = W x + b. One array has the parameters of all layers; in it W [n_out, n_in] begins at `weight` and b
/// [n_out] at `bias`.
struct MlpLayer {
  std::string_view name;  ///< trunk, sigma, bottleneck, direction, s
  std::int64_t n_in, n_out;
  std::int64_t weight, bias;
};

/// All layers, in the order of their parameters: the trunk's, sigma, bottleneck, direction, s. Throws UsageError for
/// impossible sizes.
std::vector<MlpLayer> mlp_layers(const MlpShape& shape);

std::int64_t mlp_parameter_count(const MlpShape& shape);

/// Features of an encoded vector of three components: itself, and sin and cos of 2ˡπ times it for L frequencies; none for L = −1.
constexpr int encoded_size(int n_frequencies) { return n_frequencies < 0 ? 0 : 3 * (1 + 2 * n_frequencies); }

/// The field `mlp` of SAR-NeRF (printed eqs. 25–27): a network that maps a point and the direction of the ray through
/// it to σ_r and S_r. The renderer interprets them: κ = ReLU(σ_r) / (2 Δ_ref), and S follows from S_r by a
/// non-negative activation.
///
/// The frame is world axes centred on the aim point; `box_m` is mapped to [−1, 1]³ before the encoding.
struct MlpNetwork {
  MlpShape shape;
  Box box_m;
  torch::Tensor parameters;  ///< [mlp_parameter_count(shape)] float32 that requires gradients: see mlp_layers()

  /// Views of one layer's parameters, to read or to set them (without gradients).
  torch::Tensor weight(const MlpLayer& layer) const;  ///< [n_out, n_in]
  torch::Tensor bias(const MlpLayer& layer) const;    ///< [n_out]
};

/// A network with weights uniform in ±√(6 / (n_in + n_out)) and biases of 0, as in the authors' code. The same
/// seed gives the same weights everywhere. Throws UsageError for an empty or flat box and for impossible sizes.
MlpNetwork make_mlp_network(const MlpShape& shape, const Box& box_m, std::uint64_t seed);

/// Sets to 0 what belongs to an encoded vector itself, in a network's parameters or in their gradient: printed eq. 27 has sines and
/// cosines alone.
void clear_identity(const MlpShape& shape, const torch::Tensor& of_parameters);

/// [n_samples] each, of the parameters' type.
struct MlpOutput {
  torch::Tensor sigma_raw;  ///< σ_r
  torch::Tensor s_raw;      ///< S_r
};

/// How the network is evaluated.
enum class MlpKernel {
  plain,     ///< LibTorch in the parameters' own type, float32 or double: the reference, and the fallback
  bf16,      ///< LibTorch; layers of more than one output are products of bf16 numbers, the heads of float32 ones
  amx_bf16,  ///< the same by the project's own fused kernels, which need AMX; sums and all else in float32
};

/// Whether this processor and this build have the kernel for a network of this shape: `amx_bf16` where there is AMX, the width
/// is a multiple of 64 and at most 512, the depth at most 16 and frequencies at most 12; `bf16` with AVX512-BF16 and a LibTorch
/// that has oneDNN. Elsewhere LibTorch multiplies bf16 numbers without oneDNN: slow, and gradients come out 5 to 8 % too short
/// (four networks, an AVX2 processor). Requests the use of AMX from the system, once.
bool mlp_kernel_runs(MlpKernel kernel, const MlpShape& shape);
/// The fastest one that runs.
MlpKernel best_mlp_kernel(const MlpShape& shape);
std::string_view name(MlpKernel kernel);

/// σ_r and S_r at points of rays, differentiable once by the parameters. Shapes are those of SampleBatch: ray q, of
/// direction `ray_direction[q]` (unit, from the radar into the scene), has the points [ray_begin[q], ray_begin[q + 1])
/// of `point_m`, and all points belong to a ray.
///
/// The parameters must not change before the backward pass, which skips samples without a gradient: empty space costs nothing there.
/// That of `amx_bf16` evaluates the network again for the others.
///
/// Results depend on the inputs and the kernel; the gradient also on the number of threads, but not on timing.
/// Both bf16 kernels differ from float32 by about 1 % of the outputs' spread.
///
/// Throws UsageError if array lengths or types do not match, or if the kernel does not run (mlp_kernel_runs()).
///
/// Memory for gradients: 24 bytes a sample and 10 MiB a thread for `amx_bf16`. `bf16` keeps activations, some 6 KiB a sample
/// and `plain` twice that, up to 4 GB; beyond, they are computed again.
///
/// Cost of the paper's network on one thread of a busy Xeon of the fifth generation, µs a sample, without and with the
/// gradient of all samples: 0.65 and 3.4 for `amx_bf16`, 12 and 34 for `plain` if BLAS supports the processor, 40 and 115 if
/// it does not. `bf16` was timed as training only: docs/results/learning.md.
MlpOutput mlp_forward(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                      std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin);
MlpOutput mlp_forward(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                      std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                      MlpKernel kernel);

/// Billions of additions and multiplications a second of a float32 product of 512 × 512 matrices, the fastest of
/// three, in LibTorch's threads. Cost: some milliseconds where BLAS is fast, 0.2 s where it is not.
double blas_gflop_per_s();

/// Warning for a user whose BLAS is slow; empty at 20 GFLOP/s or more. LibTorch's distribution packages
/// accept a reference BLAS that is forty times slower than a tuned one, and OpenBLAS treats processors newer than
/// itself as very old ones.
std::string slow_blas_warning(double gflop_per_s);

}  // namespace sarnerf
