// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/nerf/ground.h"

/// The steps of estimate_ground(): masks of the ground and of shadows (ground_masks.cpp), and the height (ground_height.cpp).
namespace sarnerf::ground {

using Views = std::span<const PosedImage>;
using Mask = Image<std::uint8_t>;

/// Calls visit(v) for each view, in parallel.
inline void for_each_view(Views images, const std::function<void(std::size_t)>& visit) {
  parallel_for(images.size(), 1, [&](std::size_t v, std::size_t, int) { visit(v); });
}

/// The frame of each view.
inline std::vector<RadarFrame> frames_of(Views images) {
  std::vector<RadarFrame> frames;
  for (const PosedImage& image : images) frames.push_back(radar_frame(image.acquisition));
  return frames;
}

/// Means of the square blocks that an image is cut into; what is left over at its far borders is not used.
std::vector<double> block_means(const Image<float>& power, int side);

/// 1 where the brightness of the neighbourhood is within mask_factor of the expected ground; of chips of one object, also wherever what
/// is brighter or darker is not connected to the middle.
Mask ground_mask(const Image<float>& power, const Image<float>& expected, const GroundRule& rule);

/// Sum of the masked pixels.
double masked_sum(const Image<float>& image, const Mask& mask);

/// Their number.
double masked_pixels(const Mask& mask);

/// Mean power of the cores of shadows: pixels whose neighbourhood is less than 1 / mask_factor as bright as the ground, as it is at all
/// pixels within two σ of the mask's Gaussian, so that no ground and no object beside the shadow is in it. 0 where the images have fewer such
/// pixels than a block: they show no shadow.
double noise_of_shadows(Views images, const LevelGround& plane, std::span<const Mask> masks, const GroundRule& rule);

/// A first guess: each view's gain is the median of its block means, and the ground is uniform.
struct UniformGround {
  std::vector<double> gain;
  std::vector<Mask> mask;
};

/// That of speckled and of clean views alike. Cost: a blur of each view.
UniformGround uniform_ground(Views images, const GroundRule& rule);

/// The height at which masked views agree best (estimate_ground()). The box stands on the ground unless they agree significantly better at
/// another height: then there is none to report.
std::optional<double> agreed_height_m(Views images, std::span<const Mask> masks, const Box& box_m, const GroundRule& rule);

}  // namespace sarnerf::ground
