// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// Horizontal distance, from the aim point away from the radar (m), of what each bin's centre sees of the level plane
/// `height_m` above the aim point, [n_range]; NaN in bins that are nearer than the plane. Relative to the aim point the
/// radar sees in pixel (i, j) the plane's point
///
///     height ŷ + a_i h + d_j u        u = (−sin φ, 0, −cos φ)
std::vector<double> plane_offsets_m(const Acquisition& acquisition, double height_m);

/// u: the level direction in which range grows.
glm::dvec3 level_range_direction(const Acquisition& acquisition);

}  // namespace sarnerf
