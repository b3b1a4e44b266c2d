// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {

/// Pairs of active voxels that are neighbours along an axis.
class Neighbourhood {
 public:
  explicit Neighbourhood(const GridField& field);

  /// Adds the gradient of ½ Σ_pairs Σ_c weight_c (p_c − q_c)² to `gradient`; both are [n_active, n_weights].
  void add_smoothness_gradient(const float* parameters, std::span<const float> weight, float* gradient) const;

 private:
  std::vector<std::array<std::uint32_t, 2>> pairs_;  ///< places among the active voxels
};

}  // namespace sarnerf
