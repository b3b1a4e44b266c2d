// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/nerf/trainer.h"

/// A small field `mlp`, what it can learn from, and rows of it written with LibTorch's own operations.
namespace sarnerf {

/// Four views of small_grid(), 8 × 16 pixels each.
TrainingSet small_set();

/// A network of 3 × 64 with few frequencies on voxels of half a metre, made for a few steps.
TrainerOptions small_mlp_options(const TrainingSet& set);

/// A field whose density comes and goes in space, from empty to a few optical depths a bin.
MlpField small_mlp(std::uint64_t seed, Integrator integrator = Integrator::exact);

/// Rows as the field documents them, [Σ n_range] double, differentiable by `parameters` [n] double. Segments are those
/// of RowSegments; transmittances come from the strict triangle of the matrix form (printed eqs. 9–12), for
/// `paper_gated` from the inclusive one, range bins from a matrix of shares.
torch::Tensor plain_rows(const MlpField& field, const torch::Tensor& parameters,
                         std::span<const RowRequest> rows, const RaySampling& sampling);

}  // namespace sarnerf
