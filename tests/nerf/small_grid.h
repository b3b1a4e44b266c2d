// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/nerf/grid_field.h"

/// A small learned field, and rows of it written with LibTorch's own operations.
namespace sarnerf {

/// 8 × 16 pixels of half a metre, incidence 40°.
Acquisition small_acquisition(double azimuth_rad);

/// A row of each of two views; the rays of the second one are shifted within their spacing.
std::vector<RowRequest> some_rows();

RaySampling small_sampling();

/// A ball of fog of 3 m across with random densities, from thin to opaque, and random brightness, all of it positive.
GridField small_grid(unsigned seed);

/// The same field with every voxel of its bricks active, those added of this log-depth.
GridField with_all_voxels(const GridField& field, float log_depth);

/// Rows as RowRenderer documents them, [Σ n_range] double: trilinear interpolation by indexing, transmittances by the
/// strict triangle of the matrix form (printed eqs. 9–12), range bins by a matrix of shares. Differentiable.
torch::Tensor plain_rows(const GridField& field, std::span<const RowRequest> rows, const RaySampling& sampling);

}  // namespace sarnerf
