// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// Height of the level ground relative to the aim point, where speckled views tell that it is not the bottom of the box;
/// nothing where they tell none below its top, are fewer than 6, or are not speckled.
///
/// A measured chip is centred on a target, not on the ground that it stands on: turned about the wrong point, views of the
/// ground do not fit onto one another. So each height of a row of heights gets the mean covariance, over the cells of the
/// plane and all pairs of views, of their relative deviations from the mean brightness of what looks like ground,
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
