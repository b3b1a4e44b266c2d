// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "row_part.h"

namespace sarnerf {

/// Adds the gradient of Σ_rays weight(row) D to the gradients of the segments' extinctions. With w_s = T_s (1 − e^−x_s)
/// the share of a ray's power that segment s could return, at range bins r_s and of length ℓ_s bins,
///
///     D = Σ_s Σ_t w_s w_t |r_s − r_t| + ⅓ Σ_s w_s² ℓ_s
///
/// is least when a ray returns all it returns from one place: fog becomes surface. From Barron et al., Mip-NeRF 360
/// (2022), eq. 15, with ranges in bins instead of normalised distances. Linear in segments.
void add_distortion_gradient(RowPart& part, const std::function<double(const RowPart::Row&)>& weight);

}  // namespace sarnerf
