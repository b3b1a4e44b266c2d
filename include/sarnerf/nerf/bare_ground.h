// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/background.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/box.h"

namespace sarnerf {

/// The level ground that images show around what stands on it, and where each view sees nothing else.
///
/// A place above the ground whose pixel in some view is that of bare ground is empty: matter there would shine in
/// that pixel, or throw its shadow on it, or be hidden by what shines or lies in shadow there. So images with a ground
/// carve space as zeros do, and better, since shadows take part.
struct BareGround {
  double height_m = 0.0;             ///< of the plane, relative to the aim point
  double cell_m = 0.0;               ///< of the texture
  double first_x_m = 0.0, first_z_m = 0.0;  ///< centre of texture(0, 0)
  Image<float> texture;              ///< [x, z] brightness of the ground, of the views' median; 0 where no view sees it
  std::vector<double> gain;          ///< of each view: β⁰ there is gain × texture
  std::vector<Image<std::uint8_t>> bare;  ///< of each view: pixels that agree with the texture
  double deviation = 0.0;            ///< relative deviation of pixels from gain × texture, robust (1.48 × median)

  /// Texture at a place, bilinear; 0 outside.
  double texture_at(double x_m, double z_m) const;
};

/// Looks for the ground at the bottom of the scene's box; images and box relative to the aim point. Its texture is the median of up to 48 views, turned onto the
/// plane. Nothing where half of the pixels do not agree with it within a tenth: speckle, relief, no background, or
/// too few views to tell ground from what stands on it (fewer than 6).
///
/// Cost: views × cells and views × pixels, some 50 ns each, in parallel.
std::optional<BareGround> find_bare_ground(std::span<const PosedImage> images, const Box& box_m);

}  // namespace sarnerf
