// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "mlp/kernel/mlp_kernel.h"
#include "sarnerf/nerf/mlp_network.h"

namespace sarnerf {

/// mlp_forward() by LibTorch. Layers of more than one output are products of numbers of `hidden_type`; the encoding and the
/// two heads are of the parameters' type. Where the activations that the gradient needs exceed `most_kept_bytes` they are
/// computed again.
MlpOutput mlp_forward_torch(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                            torch::ScalarType hidden_type, double most_kept_bytes);

/// The kernels for one instruction set: see mlp_kernel.h.
struct MlpKernelFunctions {
  decltype(&mlp_amx::pack) pack;
  decltype(&mlp_amx::forward) forward;
  decltype(&mlp_amx::backward) backward;
};

/// mlp_forward() by kernels that this processor has; fused_kernels_fit(), parameters are float32, and array lengths match.
MlpOutput mlp_forward_fused(const MlpNetwork& network, std::span<const glm::vec3> point_m,
                            std::span<const glm::vec3> ray_direction, std::span<const std::uint32_t> ray_begin,
                            const MlpKernelFunctions& kernel);

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
