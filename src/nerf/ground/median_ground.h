// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// Row and bin of the pixel that shows a point; nothing where the image does not hold it.
inline std::optional<glm::ivec2> pixel_of(const Acquisition& a, const RadarPoint& p) {
  const auto i = static_cast<int>(std::lround(a.row_of(p.along_track_m)));
  const auto j = static_cast<int>(std::lround(a.bin_of(p.range_offset_m)));
  if (i < 0 || i >= a.n_azimuth || j < 0 || j >= a.n_range) return {};
  return glm::ivec2(i, j);
}

/// A first look at the level ground that images show around what stands on it.
struct MedianGround {
  double height_m = 0.0;             ///< of the plane, relative to the aim point
  double cell_m = 0.0;               ///< of the texture
  double first_x_m = 0.0, first_z_m = 0.0;  ///< centre of texture(0, 0)
  Image<float> texture;              ///< [x, z] brightness of the ground, of the views' median; 0 where no view sees it
  std::vector<double> gain;          ///< of each view: β⁰ there is gain × texture
  double deviation = 0.0;            ///< relative deviation of pixels from gain × texture, robust (1.48 × median)
};

/// The ground at the bottom of the box; images and box relative to the aim point. Its texture is the median of up to 48
/// views, turned onto the plane; views' gains and texture follow from one another. Nothing where images have no background,
/// or are too few to tell ground from what stands on it (fewer than 6).
///
/// Cost: views × cells and views × pixels, some 50 ns each, in parallel.
std::optional<MedianGround> median_ground(std::span<const PosedImage> images, const Box& box_m);

/// Height of the level ground relative to the aim point, if speckled views show that it differs from the bottom of the box.
/// Nothing if they do not, if it lies above the box's top, and for fewer than 6 views or views without speckle.
///
/// A measured chip is centred on a target, not on the ground that it stands on: turned about the wrong point, views of the
/// ground do not fit onto one another. So for each of a row of heights the mean covariance is taken, over the cells of the
/// plane and all pairs of views, of their relative deviations from the mean brightness of pixels that look like ground,
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

/// The part of a view that shows what stands on a level ground: its layover, itself and its shadow, with the ground
/// there. Rays of these angles make all of these bins.
struct StandingView {
  double least_angle_rad, most_angle_rad;  ///< ray angles δ
  int first_bin, end_bin;                  ///< within the image
};

/// Of what stands inside `standing_m`, relative to the aim point like the plane's height. Where the plane leaves the
/// image, there is no limit on that side.
StandingView standing_view(const Acquisition& acquisition, const Box& standing_m, double ground_height_m);

}  // namespace sarnerf
