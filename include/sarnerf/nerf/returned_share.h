// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// How many times more power the images hold than the field returns, over what shines in it:
///
///     1 + Σ w (I − μ) / Σ w (μ − G)
///
/// over all pixels of all training views, I the image, μ the field's, G what it leaves of the ground's, w from 0 at twice the ground's
/// brightness (blurred by a pixel) to 1 at four times. Errors that count over μ² hear pixels less that speckle has made bright,
/// so that a field that follows some of it returns too little: 5 to 20 % of one look. Not in the paper.
///
/// 1 where images have no level ground or nothing shines, and never beyond a half or twice. Single glints make up most
/// of a measured target's power: there it is no scale for all directions. Cost: two rendered images a view.
/// `field` is as before afterwards; it must have no residuals.
double returned_share(GridField& field, const TrainingSet& set);

}  // namespace sarnerf
