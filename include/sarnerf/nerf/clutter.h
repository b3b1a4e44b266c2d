// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/box.h"
#include "sarnerf/nerf/level_ground.h"

namespace sarnerf {

/// Estimate of a level ground around the objects of a scene, from clean or speckled images. Under speckle single pixels are
/// too noisy, so it rests on means over views and neighbourhoods.
struct Clutter {
  std::shared_ptr<const LevelGround> ground;
  std::vector<double> gain;  ///< of each view, over that of the ground at its incidence
  std::vector<Image<std::uint8_t>> like_ground;  ///< of each view: pixels whose surroundings are as bright as the ground
  double deviation = 0.0;    ///< relative deviation of pixels from the ground, robust (1.48 × median)
  bool speckled = false;     ///< is_speckled()
};

/// Estimates the ground at the bottom of the scene's box; images and box relative to the aim point. Pixels whose
/// surroundings are between half and twice as bright as the ground are taken for ground. Their mean over views, turned onto
/// the plane, is the texture, smoothed by the Gaussian with which every other view predicts the remaining ones best. A view's
/// gain is the mean power of such pixels over the texture's. Both are found in rounds that begin with a uniform ground.
///
/// Nothing where images have no background or are fewer than 6, or are not speckled and their robust
/// deviation from the median of the views, turned onto the plane, is a fifth or more (1.48 × the median): relief, hedges. Nor
/// where fewer than a quarter of all pixels look like ground.
///
/// Cost: views × cells and views × pixels, some 50 ns each, in parallel.
std::optional<Clutter> find_clutter(std::span<const PosedImage> images, const Box& box_m);

}  // namespace sarnerf
