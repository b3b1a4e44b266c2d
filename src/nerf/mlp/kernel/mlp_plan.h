// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "mlp/kernel/mlp_kernel.h"
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

namespace sarnerf {

/// Description of a network for the fused kernels: padded sizes, and offsets of packed weights and of sums. Owns what
/// `plan` points to, and therefore cannot be copied or moved.
class MlpPlanOwner {
 public:
  MlpPlanOwner(const MlpShape& shape, const Box& box_m);
  MlpPlanOwner(const MlpPlanOwner&) = delete;
  MlpPlanOwner& operator=(const MlpPlanOwner&) = delete;

  const MlpPlan& plan() const { return plan_; }

  /// Adds up the sums of all threads in the order given: ∂L/∂parameters.
  void gradient_of_layer(std::size_t layer, const std::vector<const float*>& sums, float* gradient) const;
  void gradient_of_heads(const std::vector<const float*>& sums, float* gradient) const;

 private:
  std::vector<MlpKernelLayer> layers_;
  MlpPlan plan_{};
};

/// Whether the kernels' layouts fit a network of this shape.
bool fused_kernels_fit(const MlpShape& shape);

}  // namespace sarnerf
