// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// A level, opaque ground that rays end on, as it looks by itself. A surface and no voxels: what a ray has left when it
/// meets the ground brings back the ground's own image, so that clutter costs nothing where nothing stands.
///
///     β⁰(i, j) = Σ voxels + S(i, j) g(θ) t(x, z)
///
/// with S the two-way transmittance from the radar to the place (x, z) that pixel (i, j) sees of the ground, its
/// texture t, and its gain g at the view's incidence.
struct LevelGround {
  double height_m = 0.0;  ///< relative to the aim point
  double cell_m = 1.0;    ///< of the texture
  double first_x_m = 0.0, first_z_m = 0.0;    ///< centre of texture(0, 0)
  Image<float> texture;                       ///< [x, z] β⁰ at a gain of 1
  std::vector<double> incidence_rad, gain;    ///< of each pitch, ascending

  /// Texture at a place, bilinear, beyond its border that of the border.
  double texture_at(double x_m, double z_m) const;

  /// Gain at an incidence: linear between pitches, beyond them that of the last.
  double gain_at(double incidence_rad) const;

  /// Mean of the texture at the first pitch's gain.
  double mean_power() const;
};

/// What the bins of a row see of a ground.
struct GroundBins {
  std::vector<double> angle_rad;  ///< of the rays that meet it at the bins' centres; NaN nearer than the plane
  std::vector<float> power;       ///< β⁰ of the bare ground; 0 nearer than the plane
};
GroundBins ground_bins(const LevelGround& ground, const Acquisition& acquisition, int row);

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
