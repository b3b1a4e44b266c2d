// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/nerf/archive.h"
#include "sarnerf/nerf/grid_field.h"

namespace sarnerf {

/// Adam (Kingma and Ba 2015, algorithm 1) for a GridField's parameters, in one pass over them. Voxels that no ray of
/// the batch met stay as they are, their means of gradients included: where few rows pass, what is left of an old mean
/// over an old square would go on moving them at the full rate. β₁ = 0.9; β₂ = 0.99, since rows are few and what they
/// show differs; no ε to speak of, since gradients are small numbers. Decay is decoupled
/// from the gradients (Loshchilov and Hutter 2019).
class VoxelAdam {
 public:
  explicit VoxelAdam(const GridField& field);

  /// Rates of one step.
  struct Rates {
    double density, source;
    double source_decay = 0.0;  ///< share of the brightness that goes with every step, decoupled from the gradients
  };

  /// Moves the field's parameters by their gradients. `share` [n_active]: of the rates; 0 for voxels that take no part.
  void step(GridField& field, std::span<const float> share, const Rates& rates);

  /// After prune(): of the voxels of before, these are left.
  void keep(const torch::Tensor& places);

  std::int64_t steps() const { return steps_; }
  void save(Archive& archive) const;
  void restore(const Archive& archive, std::int64_t steps, const std::string& where);

 private:
  std::int64_t steps_ = 0;
  torch::Tensor mean_density_, square_density_;  ///< [n_active]
  torch::Tensor mean_source_, square_source_;    ///< [n_active, n_harmonics]
};

}  // namespace sarnerf
