// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sarnerf/nerf/grid_field.h"
#include "sarnerf/nerf/training_set.h"

namespace sarnerf {

/// Ratio of the power in the images to the power that the field returns, over pixels brighter than the ground:
///
///     1 + Σ w (I − μ) / Σ w (μ − G)
///
/// over all pixels of all training views; I the image, μ the field's, G what the ground alone contributes to μ, and w a weight
/// that rises from 0 where μ (blurred by a pixel) is twice the ground's brightness to 1 where it is four times.
///
/// The relative loss, errors over μ, weighs a pixel less once the field has followed its speckle upwards, so that a field that
/// follows some of the speckle returns too little power: 5 to 20 % under one look. One factor for the brightness of all voxels
/// takes this bias out of the sum. It changes the scale, and no shape. Not in the paper.
///
/// 1 where images have no level ground or no pixel is that bright; at least a half and at most 2. 1, too, where targets glint,
/// as measured ones do: single glints in few directions make up most of their power, and one factor for all directions would
/// brighten the rest. Targets glint where the variance of √(I/μ) over pixels of weight w exceeds that over the ground, which is
/// the speckle's, by 0.1 or more.
///
/// `field` is unchanged afterwards. Cost: two rendered images a view.
double returned_share(GridField& field, const TrainingSet& set);

}  // namespace sarnerf
