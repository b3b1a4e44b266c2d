// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// Views of a training set, or of part of it.
using Views = std::span<const PosedImage* const>;

/// All training views, after a look at each: throws as interpolate_view() does for them.
std::vector<const PosedImage*> checked_views(std::span<const PosedImage> training);

/// A training view and its share in a prediction; shares add up to 1.
struct Neighbour {
  const PosedImage* view;
  double weight;
};

/// Views of nearly equal incidence.
struct Pitch {
  double incidence_rad = 0.0;  ///< mean of the views'
  std::vector<const PosedImage*> views;
};

/// The views grouped by incidence, smallest first. Within a pitch they keep their order.
std::vector<Pitch> pitches(Views training);

/// The view whose line of sight is nearest to the wanted one; of equals the first.
Neighbour nearest_view(Views training, const Acquisition& wanted);

/// The next view on each side in azimuth, around the circle, with weights that are linear in azimuth. One alone
/// where a view stands at the wanted azimuth or there is only one. Of several at one azimuth the one nearest in
/// incidence, of equals the first.
std::vector<Neighbour> azimuth_neighbours(const Pitch& pitch, const Acquisition& wanted);

/// The six views nearest in azimuth, on whatever side, or all where there are fewer, with equal weights. Of equally near
/// ones those nearest in incidence, of equals the first.
std::vector<Neighbour> nearest_azimuths(const Pitch& pitch, const Acquisition& wanted);

/// The pitch nearest in incidence; of equals the smaller.
const Pitch& nearest_pitch(std::span<const Pitch> all, double incidence_rad);

/// The neighbours that `of_pitch` finds at the pitches below and above, with weights that are linear in incidence too;
/// of the border's alone beyond it.
std::vector<Neighbour> neighbours_of_two_pitches(
    std::span<const Pitch> all, const Acquisition& wanted,
    std::vector<Neighbour> (*of_pitch)(const Pitch&, const Acquisition&));

}  // namespace sarnerf
