// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/dataset/view_interpolation.h"
#include "view_neighbours.h"
#include "warped_view.h"

namespace sarnerf {

/// What is averaged, and comes out.
enum class Average { power, amplitude };

/// interpolate_view() between views that were checked, which may be a part of the training set.
Image<float> interpolate_between(Views training, const Acquisition& wanted, Interpolation method,
                                 double plane_height_m, Average average = Average::power);

/// Σ weight × view on the grid of `wanted`, each warped by the plane. See interpolate_view().
Image<float> weighted_mean(std::span<const Neighbour> neighbours, const Acquisition& wanted,
                           Warp warp, double plane_height_m, Average average = Average::power);

}  // namespace sarnerf
