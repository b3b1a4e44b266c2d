// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"

/// Images of unseen views from the training images alone, without a model of the scene: what a learned field has
/// to beat before it has learned anything.
namespace sarnerf {

/// How. A pitch is a group of training views of nearly equal incidence: sorted by incidence, views belong together
/// up to a step of more than 0.25°, so that measured angles that scatter about a nominal one stay one pitch. Where
/// there are several, the methods that are not said to take two take the pitch nearest to the wanted incidence.
enum class Interpolation {
  nearest,          ///< the view whose line of sight makes the smallest angle with the wanted one
  linear,           ///< the two neighbours in azimuth, around the circle, weighted by distance
  rescaled_linear,  ///< the same, ranges rescaled to the wanted incidence; azimuths stay
  rotated_linear,   ///< the same, each turned to the wanted azimuth and incidence
  bilinear,         ///< `linear` at the pitches above and below, or the outermost, weighted too
  rotated_bilinear,  ///< `rotated_linear` at the pitches above and below
  rotated_mean,  ///< the mean of the six views nearest in azimuth, each turned as by `rotated_linear`: less speckle
  rotated_mean_bipitch  ///< `rotated_mean` at the pitches above and below, weighted by distance
};

/// "nearest view", "linear in azimuth", …: for the rows of tables.
std::string_view name(Interpolation method);

/// Whether the height of interpolate_view()'s plane makes a difference to the method.
bool supposes_plane(Interpolation method);

/// The methods that differ from one another on these views: `nearest`, `linear` and `rotated_linear`, and all six
/// where the views have more than one pitch. Those that average to be rid of speckle are despeckling_for()'s.
std::vector<Interpolation> interpolations_for(std::span<const PosedImage> training);

/// The methods worth a blur where images are speckled: `rotated_linear` and `rotated_mean`, and where the views have
/// more than one pitch `rotated_mean_bipitch`.
std::vector<Interpolation> despeckling_for(std::span<const PosedImage> training);

/// The image that `method` predicts on the grid of `wanted`, linear power.
///
/// Pixels of another grid are met by their distances from the wanted aim point along track and in range, in metres,
/// whatever the sizes, spacings, looks and aim points; values between pixels are bilinear, beyond the image's border
/// 0. Turning and rescaling suppose that all matter lies on one horizontal plane, y = `plane_height_m` above the wanted
/// aim point: the plane's point that the wanted radar sees in pixel (i, j),
///
///     p = aim + y ŷ + a_i h + (g_j − r sin θ) u
///     g_j = √(R_j² − (r cos θ − y)²)   u = (−sin φ, 0, −cos φ)
///
/// is looked up where the training view sees it (project()), so range shrinks or grows by the ratio of the sines of
/// the incidences; bins nearer than the plane are 0. Values are carried over as they are. Every method
/// but the means returns a training view's own image, bit by bit, where nothing else was taken from that azimuth at
/// that pitch.
///
/// Throws UsageError without training images and where an image has not the size that its acquisition says;
/// GeometryError for an impossible acquisition. Cost: linear in the pixels wanted, at most two images looked up at
/// each (bilinear methods: four; means: six or twelve), rows in parallel.
Image<float> interpolate_view(std::span<const PosedImage> training, const Acquisition& wanted,
                              Interpolation method, double plane_height_m = 0.0);

/// The height of the plane (m above the aim point) for which turned views predict each other best: the one with the
/// highest mean PSNR of `rotated_linear` on training views that are left out one at a time. The plane through the aim
/// point, at the foot of a building, turns its walls and its roof about the wrong places: a learned field that beats
/// that alone has beaten little. Up to twelve views spread over the set are left out; heights up to half a swath above
/// and below the aim point are tried in 33 steps, then to a sixteenth of a step. 0 for fewer than two views and for
/// blank ones. Throws as interpolate_view(), and Interrupted when the monitor asks for it. Cost: some 500 predicted
/// views, in parallel; the training views' memory is not copied.
double fitted_plane_height_m(std::span<const PosedImage> training, const Monitor& monitor = {});

}  // namespace sarnerf

/// What a learned field is compared with: views interpolated from the training images, with the choices that each
/// method leaves open made by those images alone.
namespace sarnerf {

/// One way of interpolation to compare with.
struct Baseline {
  Interpolation method = Interpolation::linear;
  double plane_height_m = 0.0;  ///< see interpolate_view(); of methods that turn or rescale
  double blur_pixels = 0.0;     ///< σ of the gaussian_blur() of what comes out
  /// Amplitudes are averaged and blurred, and squared at the end: what glints in one view then counts less. Speckle of
  /// one look comes out too dark by π/4.
  bool of_amplitudes = false;
};

/// name() of the method, with the height of its plane unless that goes through the aim point, its blur, if any, and whether
/// amplitudes are averaged.
std::string name(const Baseline& baseline);

/// interpolate_view(), blurred. Throws, and costs, as that does.
Image<float> baseline_view(std::span<const PosedImage> training, const Acquisition& wanted,
                           const Baseline& baseline);

/// The σ (pixels) among 0, 0.7, 1, 1.5 and 2 with which the baseline predicts training views best that are left out one
/// at a time, as fitted_plane_height_m() chooses its plane: against single, speckled views, since no other truth is
/// known, and what averages speckle away comes closer to those, too. The smallest for fewer than two views and for blank
/// ones. Throws as interpolate_view(), and Interrupted when the monitor asks for it. Cost: 60 predicted views.
double fitted_blur_pixels(std::span<const PosedImage> training, const Baseline& baseline,
                          const Monitor& monitor = {});

/// interpolations_for() the training images, each that supposes a plane twice: with the plane through the aim point
/// and with the one at fitted_plane_height_m(). Where the images are speckled (is_speckled()), despeckling_for() them
/// as well, of power and of amplitudes, with fitted_blur_pixels() and both planes. None without training images. Cost: that of the fits.
std::vector<Baseline> default_baselines(std::span<const PosedImage> training,
                                        const Monitor& monitor = {});

}  // namespace sarnerf

namespace sarnerf {

/// Finds each image's shift (Acquisition::azimuth_shift_m, range_shift_m) from the images alone: each is correlated with the mean
/// of its six nearest neighbours of the same pitch, turned onto it by the level plane `plane_height_m` above the aim point. The
/// shifts are those that agree with all correlations best, with a Gaussian prior of standard deviation `prior_pixels`, so that what
/// neighbours cannot say (shifts that vary slowly with azimuth) stays small. The common translation is taken out.
///
/// Pixels are never interpolated: only the acquisitions change. Nothing is known of a view without others at its pitch. Cost: three
/// rounds of seven turned images and some 50 products of images a view, in parallel. Throws as interpolate_view(), and Interrupted
/// when the monitor asks for it.
void register_views(std::span<PosedImage> images, double prior_pixels = kCut_pixels, double plane_height_m = 0.0,
                    const Monitor& monitor = {});

}  // namespace sarnerf
