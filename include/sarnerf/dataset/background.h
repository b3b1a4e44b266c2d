// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "sarnerf/dataset/posed_image.h"

/// What images show around the scene: nothing, an even ground, or speckle.
namespace sarnerf {

/// Whether most of the pixels return power: the images show a ground, or clutter, and zeros tell nothing of space.
bool has_background(std::span<const PosedImage> images);

/// Whether that background is there to be seen: most of the pixels return more than the brightest one less 80 dB. The
/// tails of an impulse response or of a smooth object are positive everywhere, and are no background.
bool has_visible_background(std::span<const PosedImage> images);

/// Looks of which the images' speckle is made: the median over up to 24 views of equivalent_looks() at the quantile
/// 0.9 of each view's windows. Texture of a ground without speckle has windows that are flat, and speckle has none, so
/// it is the flattest windows that tell them apart; the price is an estimate too high by about half, and by 2.5 times
/// where neighbouring pixels are much alike (equivalent_looks() has the figures). None without a visible background.
std::optional<double> looks_of(std::span<const PosedImage> images);

/// Whether there is speckle to be rid of: a visible background of fewer than 50 looks, a fluctuation of 14 % and more.
bool is_speckled(std::span<const PosedImage> images);

}  // namespace sarnerf
