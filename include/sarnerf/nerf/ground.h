// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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

/// A level, opaque plane with its own brightness, on which rays end. It is a surface without voxels: the power that a ray
/// still carries when it meets the plane returns with the plane's brightness. Clutter costs nothing where no object stands
/// on it.
///
///     β⁰(i, j) = Σ voxels + n + S(i, j) max(0, g(θ) t(x, z) − n)
///
/// with S the two-way transmittance from the radar to the point (x, z) of the plane that pixel (i, j) sees, t the plane's
/// texture there, g its gain at the view's incidence, and n the power of noise. An image of the bare plane, g t, has noise in it. Without n
/// the noise of a shadow would be learned as ground that is seen through translucent matter.
struct LevelGround {
  double height_m = 0.0;  ///< relative to the aim point
  double cell_m = 1.0;    ///< of the texture
  double first_x_m = 0.0, first_z_m = 0.0;    ///< centre of texture(0, 0)
  Image<float> texture;                       ///< [x, z] β⁰ at a gain of 1
  std::vector<double> incidence_rad, gain;    ///< of each pitch, by ascending incidence
  double noise = 0.0;                         ///< β⁰ that remains in a full shadow

  /// Texture at a point of the plane: bilinear; beyond the border, the value at the border.
  double texture_at(double x_m, double z_m) const;

  /// Gain at an incidence θ. The backscatter γ⁰ = β⁰ tan θ (E2) is linear between pitches, and beyond them that of the nearest pitch: rough
  /// ground has nearly the same γ⁰ at all but steep and grazing incidences.
  double gain_at(double incidence_rad) const;

  /// Mean of the texture at the first pitch's gain.
  double mean_power() const;
};

/// A ground in the range bins of a row.
struct GroundBins {
  std::vector<double> angle_rad;  ///< ray angles δ at which the bins' centres see the ground; NaN in bins nearer than the plane
  std::vector<float> power;       ///< β⁰ of the bare ground, with noise; 0 in bins nearer than the plane
  double noise = 0.0;             ///< β⁰ of noise

  /// What of a bin's power a shadow takes away.
  double shaded(std::size_t bin) const { return std::max(0.0, double{power[bin]} - noise); }
};
GroundBins ground_bins(const LevelGround& ground, const Acquisition& acquisition, int row);

/// A view of the bare ground, β⁰.
Image<float> ground_image(const LevelGround& ground, const Acquisition& acquisition);

/// The part of a view that an object on a level ground can change: its layover, the object and its shadow. Only rays at
/// these angles contribute to these bins.
struct LayoverShadowWindow {
  double least_angle_rad, most_angle_rad;  ///< ray angles δ
  int first_bin, end_bin;                  ///< within the image
};

/// The window of an object that fills `object_m`. Box and ground height are relative to the aim point. On a side where
/// the plane leaves the image, the angle has no limit.
LayoverShadowWindow layover_shadow_window(const Acquisition& acquisition, const Box& object_m, double ground_height_m);

/// Parameters of estimate_ground(), carve() and training_set(), and their origin. "Chosen" means by hand, on the scenes
/// that docs/results/ablation.md names as development scenes; "limit" means that only the cost depends on it, no result.
struct GroundRule {
  /// With fewer views, the ground cannot be separated from an object that covers different pixels in each view. Chosen.
  std::size_t least_views = 6;
  /// Side of the blocks (pixels) whose means give a view's first gain: at one look, a mean of 100 pixels has a standard
  /// deviation of 10 %. In images of fewer than `least_blocks` blocks, their median is unreliable. Chosen.
  int block_pixels = 10;
  std::size_t least_blocks = 9;
  /// A pixel is ground where its neighbourhood, a Gaussian of this σ, is between 1/factor and factor times as bright as the
  /// ground. Under speckle of one look, such means have a standard deviation of 19 % (1 / √(4π σ²)). Chosen.
  double mask_sigma_pixels = 1.5, mask_factor = 2.0;
  /// Rounds in which masks, gains and texture are estimated from one another. Limit: later rounds change nothing.
  int n_rounds = 3;
  /// Gaussian σ (cells) of the texture's smoothing, chosen by cross-validation. Limit: octaves from a cell to the box.
  std::vector<double> texture_sigmas_cells = {1.0, 2.0, 4.0, 8.0, 16.0};
  /// Smallest fraction of the pixels that must be ground. The medians of the first step need a majority.
  double least_ground_fraction = 0.5;
  /// Largest robust deviation of unspeckled pixels from the plane's image: relief and hedges deviate more. Chosen.
  double most_deviation = 0.2;
  /// Spacing of the heights that are tried, and their largest distance to either side (pixels of slant range). Limit.
  double height_step_pixels = 0.5, height_reach_pixels = 6.0;
  /// Gaussian σ of the blur before heights are compared: half the correlation width of speckle. Chosen.
  double height_sigma_pixels = 1.0;
  /// Standard deviations of V by which V at the best height must exceed V at the bottom of the box. (The difference of two
  /// independent values has √2 of them, and 25 heights are tried.) Also the standard errors by which V must exceed 0 there:
  /// 11 to 17 for measured chips, below 2.5 where only objects agree. Chosen.
  double height_significance = 4.0;
  /// A point is empty if at least this fraction of the views that see it show bare ground there and in its shadow. In some
  /// views, an object may be as bright as the ground. Chosen.
  double bare_fraction = 0.3;
  /// Above 0: the images are chips of one object about the aim point. What does not hang together with pixels this near to the middle
  /// (connected_to_middle()) is ground, however bright, and matter lies only where all views see it. With few views, a patch of bright
  /// clutter in one of them would else be matter, which casts a shadow in every other view. Half the size of the object.
  int object_reach_pixels = 0;
  /// Whether the images of speckled scenes have noise, which their shadows show. It is the sensor's physics; without it for ablations.
  bool noise = true;
  /// Greatest height of objects under speckle, as a fraction of the swath in ground range; at small depressions the shadow
  /// bounds it further (SceneHeights). Kept for speed: training takes 1.6 times as long without. Chosen.
  double object_height_fraction = 0.25;
  /// Where images of an unknown impulse response show no ground, pixels below this fraction of the peak are its tails: they
  /// reach everywhere, also where the scene is empty. 0: no pixel is a tail. Chosen.
  double tail_level = 1e-4;
};

/// The level ground around the objects of a scene, estimated from its images.
struct GroundEstimate {
  std::shared_ptr<const LevelGround> plane;
  std::vector<Image<std::uint8_t>> mask;   ///< of each view: 1 where a pixel shows bare ground
  double deviation = 0.0;                  ///< relative deviation of pixels from the plane's image, robust (1.48 × median)
  std::optional<double> looks;             ///< looks_of() the images
  bool speckled = false;                   ///< is_speckle(looks)

  /// Fraction of the pixels that show bare ground.
  double part_of_pixels() const;
};

/// Estimates plane, gains, texture and masks together. Images and box are relative to the aim point.
///
/// The first masks come from a uniform ground, with the median of block means as each view's gain. The height is `height_m`, if
/// given. Else it is, under speckle, the height at which masked views agree best (below), otherwise the bottom of the box. Then,
/// in rounds: masks from the plane's image, gains from the mean power of masked pixels, and the texture as the mean of masked
/// pixels over the views. The texture is uniform, or smoothed by a Gaussian, whichever lets every other view predict the
/// remaining ones best.
///
/// Height: r are the relative deviations of masked pixels from their view's mean. Their mean covariance V(h), over the plane's
/// cells and all pairs of views, is computed for a series of heights h:
///
///     V(h) = ⟨[(Σ_v r_v)² − Σ_v r_v²] / [n (n − 1)]⟩_cells
///
/// At the true height it is the variance of the ground's texture; it falls off evenly to both sides. The best height is
/// accepted if V exceeds its value at the bottom of the box by `height_significance` standard deviations of V under
/// independent speckle, and exceeds 0 by as many standard errors, as they follow from the scatter of V between 8 × 8 regions of
/// the plane. Without the second condition, pixels of an object that masks leave could determine the height: views agree
/// on them, too, but in few regions. A parabola through its neighbours refines the height. (A measured chip is centred on a
/// target, not on the ground.)
///
/// Noise: under speckle, the mean power of the cores of shadows, which lie 2 σ of the masks' Gaussian inside of pixels whose neighbourhood is
/// less than half as bright as the ground (1 / mask_factor). 0 if they have fewer pixels than a block. Sidelobes and multiple bounces in
/// shadows count as noise.
///
/// Returns nothing if images have no background or are too few or too small, if less than `least_ground_fraction` of their
/// pixels is ground, or if they have no speckle and deviate from the plane by `most_deviation` or more.
///
/// Cost: rounds × views × pixels, some 200 ns each, and heights × cells × views, some 30 ns each; in parallel.
std::optional<GroundEstimate> estimate_ground(std::span<const PosedImage> images, const Box& box_m,
                                              std::optional<double> height_m = {}, const GroundRule& rule = {});

/// The height of the ground (m above the aim point) of several scenes that are centred on their objects alike, such as chips of several
/// targets: the height at which they agree best, with V averaged over all scenes. Few views of each are enough: four of ten targets have
/// 60 pairs. Chips are centred on an object, not on the ground, so that no height is likely before: V needs to exceed 0 significantly, but not
/// V at the bottom of the box. Nothing if no height is significant. Cost: that of estimate_ground()'s height for each scene.
std::optional<double> common_ground_height_m(std::span<const std::vector<PosedImage>> scenes, const Box& box_m,
                                             const GroundRule& rule = {});

/// Number of views that see a point over the ground, and of those among them that show bare ground both there and where the
/// point's shadow would fall. An object at the point would brighten the first pixel and darken the second. A shadow beyond
/// the image counts as bare ground.
struct BareViews {
  std::size_t n_seeing = 0, n_bare = 0;
};
BareViews bare_views(const GroundEstimate& ground, std::span<const PosedImage> images, std::span<const RadarFrame> frames,
                     const glm::dvec3& point_m);

}  // namespace sarnerf
