// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sarnerf/dataset/posed_image.h"

namespace sarnerf {

/// A pixel that no scatterer explains.
struct Outlier {
  std::size_t image = 0;  ///< place in the list of images
  int i = 0, j = 0;       ///< azimuth row, range bin
  float power = 0.0f;     ///< as it was found
  float limit = 0.0f;     ///< the largest power of the pixels that are no outliers
};

/// Damaged pixels of a set of images of one scene, brightest first.
///
/// A scatterer is seen in more than one pixel: the impulse response spreads it, and other views see it, too. So the
/// powers of a set of images go up to the largest without a gap. Pixels above the lowest gap of a factor of ten among the
/// largest powers are outliers if they are at most one in 10,000 (or a single one) and lie in at most a quarter of the
/// images; sets of fewer than four images have none. A flash of a wall, which is bright in one view only, has more pixels
/// than that. Neither the solids, vehicles and buildings that this project measures with, clean or speckled, nor any of the
/// ten classes of MSTAR has an outlier.
///
/// Cost: one pass over all pixels.
std::vector<Outlier> find_outliers(std::span<const PosedImage> images);

/// Sets the outliers of find_outliers() to their limit and returns them: one such pixel would else be all that a mean
/// square counts, and the peak that every PSNR refers to.
std::vector<Outlier> limit_outliers(std::span<PosedImage> images);

/// One line for a warning: which image, which pixel, what it holds, what it counts for.
std::string outlier_text(const Outlier& outlier, std::span<const PosedImage> images);

}  // namespace sarnerf
