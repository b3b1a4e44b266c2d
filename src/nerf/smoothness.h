// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {

/// The neighbours of active voxels along the axes.
class Neighbourhood {
 public:
  explicit Neighbourhood(const GridField& field);

  /// Adds the gradient of ½ Σ_pairs Σ_c weight_c (p_c − q_c)² to that of the voxels whose `share` [n_active] is not 0;
  /// `parameters` and `gradient` are [n_active, n_weights].
  void add_smoothness_gradient(const float* parameters, std::span<const float> weight, std::span<const float> share,
                               float* gradient) const;

 private:
  std::vector<std::array<std::uint32_t, 6>> around_;  ///< places among the active voxels, its own where there is none
};

}  // namespace sarnerf
