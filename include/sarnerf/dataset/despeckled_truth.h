// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// Measured views averaged with their neighbours, for want of a truth without speckle.
struct DespeckledTruth {
  std::vector<std::size_t> which;  ///< places of these views among those that the truth was made of
  std::vector<PosedImage> views;  ///< the truth, each named and posed as the view in its middle
  /// Of each, the mean of other views about it: an estimate as good as the truth itself and independent of it. What is
  /// as close to the truth as this is as good as measuring.
  std::vector<Image<float>> true_neighbours;
};

/// Splits views that nobody trained on, pitch by pitch (see Interpolation), into the first, third, fifth … and the
/// second, fourth, … in the order of azimuth. The truth is the mean of the odd views, in power, not further than
/// `reach_rad` in azimuth from an odd one, each turned to its azimuth and incidence as rotated_linear turns them, by
/// the level plane through the aim point: over a few degrees its height matters little. Its true neighbours are
/// the same of the even views. Odd views without another odd one and without an even one within reach are left out.
///
/// At intervals of a degree a reach of 3° has two or three views each, so that the truth keeps some speckle, and no
/// method that is judged by it can come as close as to a clean one.
///
/// Throws UsageError for a reach that is not in (0, π), and as interpolate_view() for the views. Cost: a turned image
/// for each view within reach.
DespeckledTruth despeckled_truth(std::span<const PosedImage> unseen, double reach_rad);

}  // namespace sarnerf
