// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/nerf/mlp_network.h"

/// The two implementations of mlp_forward(), whose arguments have been checked.
namespace sarnerf {

MlpOutput mlp_forward_plain(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin);

/// `kernel` is available and not `plain`.
MlpOutput mlp_forward_fused(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                            MlpKernel kernel);

}  // namespace sarnerf
