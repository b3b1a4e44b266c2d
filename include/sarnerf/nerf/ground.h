// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf {

/// A level, opaque plane that rays end on, with its own brightness. It is a surface and has no voxels: the power that a ray
/// still carries when it meets the plane returns with the plane's brightness, so that clutter costs nothing where nothing
/// stands on it.
///
///     β⁰(i, j) = Σ voxels + S(i, j) g(θ) t(x, z)
///
/// with S the two-way transmittance from the radar to the point (x, z) of the plane that pixel (i, j) sees, t the plane's
/// texture there, and g its gain at the view's incidence.
struct LevelGround {
  double height_m = 0.0;  ///< relative to the aim point
  double cell_m = 1.0;    ///< of the texture
  double first_x_m = 0.0, first_z_m = 0.0;    ///< centre of texture(0, 0)
  Image<float> texture;                       ///< [x, z] β⁰ at a gain of 1
  std::vector<double> incidence_rad, gain;    ///< of each pitch, ascending

  /// Texture at a point of the plane, bilinear, beyond its border that of the border.
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

/// A view of the bare ground, β⁰.
Image<float> ground_image(const LevelGround& ground, const Acquisition& acquisition);

/// The part of a view that an object on a level ground can change: its layover, itself and its shadow. Rays of these
/// angles make all of these bins.
struct LayoverShadowWindow {
  double least_angle_rad, most_angle_rad;  ///< ray angles δ
  int first_bin, end_bin;                  ///< within the image
};

/// Of all that lies inside `object_m`, relative to the aim point as the plane's height is. Where the plane leaves the
/// image, there is no limit on that side.
LayoverShadowWindow layover_shadow_window(const Acquisition& acquisition, const Box& object_m, double ground_height_m);

/// The numbers of estimate_ground(), and where each comes from. "Chosen" means by hand, on the scenes that
/// docs/results/ablation.md names as development scenes; "limit" means that no result depends on it but cost.
struct GroundRule {
  /// Fewer views cannot separate the ground from an object that covers other pixels of each. Chosen.
  std::size_t least_views = 6;
  /// Side of the blocks whose means give a view's first gain (pixels): of one look, a mean of 144 pixels is known to 8 %. Images
  /// of fewer blocks have no median of them to speak of. Chosen.
  int block_pixels = 12;
  std::size_t least_blocks = 9;
  /// A pixel is ground where its neighbourhood, a Gaussian of so many pixels, is between 1/factor and factor times as bright as
  /// the ground: under speckle of one look, such means scatter by 19 % (1 / √(4π σ²)). Chosen.
  double mask_sigma_pixels = 1.5, mask_factor = 2.0;
  /// Rounds of mask, gains and texture from one another. Limit: later rounds change nothing.
  int n_rounds = 3;
  /// Widths (cells) of the texture's smoothing that cross-validation may choose. Limit: octaves from a cell to the box.
  std::vector<double> texture_sigmas_cells = {1.0, 2.0, 4.0, 8.0, 16.0};
  /// Least part of the pixels that is ground. The medians of the first step need a majority.
  double least_part = 0.5;
  /// Largest robust deviation of unspeckled pixels from the plane's image: relief and hedges deviate more. Chosen.
  double most_deviation = 0.2;
  /// Heights are tried so many pixels of slant range apart, and as far to either side. Limit.
  double height_step_pixels = 0.5, height_reach_pixels = 6.0;
  /// Images are blurred by this before heights are compared: half the width of speckle's own correlation. Chosen.
  double height_sigma_pixels = 1.0;
  /// Standard deviations by which the best height must exceed the bottom of the box: one in 2000 by chance, and 25 heights are
  /// tried.
  double height_significance = 3.5;
  /// Space is empty where this part of the views that see it, or more, shows bare ground there and in its shadow; an object may be
  /// as bright as the ground in some. Space that fewer than `least_seeing_part` of all views see is given up. Chosen.
  double bare_part = 0.3, least_seeing_part = 0.25;
  /// Greatest height of objects under speckle, of the level width that a view sees: chips whose shadows lie outside of them do
  /// not bound it. Chosen.
  double object_height_part = 0.25;
};

/// What the images of a scene show of a level ground around its objects.
struct GroundEstimate {
  std::shared_ptr<const LevelGround> plane;
  std::vector<Image<std::uint8_t>> mask;   ///< of each view: 1 where a pixel shows bare ground
  double deviation = 0.0;                  ///< relative deviation of pixels from the plane's image, robust (1.48 × median)
  std::optional<double> looks;             ///< looks_of() the images
  bool speckled = false;                   ///< is_speckled()

  /// Part of the pixels that the masks hold.
  double part_of_pixels() const;
};

/// Estimates plane, gains, texture and masks together. Images and box are relative to the aim point.
///
/// A uniform ground with the median of block means as each view's gain gives the first masks. Under speckle, the height is
/// then the one at which masked views agree best, unless `height_m` is given (below); without speckle, it is the bottom of the
/// box. Then, in rounds: masks from the plane's image, gains from the mean power of masked pixels, and the texture as the mean
/// of masked pixels over the views, smoothed by the Gaussian with which every other view predicts the remaining ones best.
///
/// Height: for each of a row of heights h, the mean covariance over the plane's cells and all pairs of views of the relative
/// deviations r of masked pixels from their view's mean,
///
///     V(h) = ⟨[(Σ_v r_v)² − Σ_v r_v²] / [n (n − 1)]⟩_cells
///
/// is the variance of the ground's texture at the true height, and falls off evenly to both sides of it. The best height
/// counts where V exceeds its value at the bottom of the box by `height_significance` standard deviations of what independent
/// speckle makes of it; a parabola through its neighbours refines it. (A measured chip is centred on a target, not on the ground.)
///
/// Nothing where images have no background or are too few or too small, where less than `least_part` of their pixels is ground, and
/// where they have no speckle and deviate from the plane by `most_deviation` or more.
///
/// Cost: rounds × views × pixels, some 200 ns each, and heights × cells × views, some 30 ns each; in parallel.
std::optional<GroundEstimate> estimate_ground(std::span<const PosedImage> images, const Box& box_m,
                                              std::optional<double> height_m = {}, const GroundRule& rule = {});

/// Of the views that see a point over the ground: how many, and how many of them show bare ground both there and where the
/// point's shadow would fall. An object there would brighten the one pixel and darken the other. A shadow beyond the image
/// counts as bare.
struct BareViews {
  std::size_t n_seeing = 0, n_bare = 0;
};
BareViews bare_views(const GroundEstimate& ground, std::span<const PosedImage> images, std::span<const RadarFrame> frames,
                     const glm::dvec3& point_m);

}  // namespace sarnerf
