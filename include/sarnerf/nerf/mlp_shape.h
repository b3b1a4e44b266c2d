// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace sarnerf {

/// Sizes of the network of SAR-NeRF. The defaults are those of its authors' code (the paper gives none): 595,586
/// parameters.
///
///     encoded position ─► trunk: depth × width, ReLU ─┬─► sigma (1)
///                                                     └─► bottleneck: width
///     bottleneck, encoded direction ─► direction: width / 2, ReLU ─► s (1)
///
/// The trunk sees the encoded position again in front of its output number `skip`, the layer `direction` the encoded
/// direction behind the bottleneck's output.
struct MlpShape {
  int depth = 8;    ///< ≥ 1
  int width = 256;  ///< even, ≥ 2
  int skip = 4;     ///< 0-based; negative for none, else less than depth − 1
  int position_frequencies = 10;  ///< L of eq. 27 for the position, ≥ 0
  int direction_frequencies = 4;  ///< the same for the direction

  bool operator==(const MlpShape&) const = default;
};

/// One affine map y = W x + b. The parameters of all are one array, in which W [n_out, n_in] begins at `weight` and b
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

/// Features of an encoded vector of three components: itself, and sin and cos of 2ˡπ times it for L frequencies.
constexpr int encoded_size(int n_frequencies) { return 3 * (1 + 2 * n_frequencies); }

}  // namespace sarnerf
