// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// Height of the level ground relative to the aim point, if speckled views show that it differs from the bottom of the box.
/// Nothing if they do not, if it lies above the box's top, and for fewer than 6 views or views without speckle.
///
/// A measured chip is centred on a target, not on the ground that it stands on: turned about the wrong point, views of the
/// ground do not fit onto one another. So for each of a row of heights the mean covariance is taken, over the cells of the
/// plane and all pairs of views, of their relative deviations from the mean brightness of pixels that look like ground,
///
///     V(h) = ⟨[(Σ_v r_v)² − Σ_v r_v²] / [n (n − 1)]⟩_cells
///
/// which is the variance of the ground's texture at the true height, and falls off evenly to both sides of it. The best
/// height counts where V is larger than at the bottom of the box by more than 3.5 standard deviations of what independent
/// speckle makes of it. Heights reach as far as six pixels of slant range, half a pixel apart, and the best one is refined by
/// the parabola through its neighbours.
///
/// Cost: heights × cells × views, some 30 ns each, in parallel; there are about 10⁴ cells, and 25 heights.
std::optional<double> ground_height_m(std::span<const PosedImage> images, const Box& box_m);

}  // namespace sarnerf
