// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/posed_image.h"

/// Predicts images of unseen views from the training images alone, without a model of the scene. A field that does not
/// beat these baselines has learned nothing.
namespace sarnerf {

/// Interpolation methods. A pitch is a group of training views of nearly equal incidence: in views sorted by incidence, a
/// step of more than 0.25° begins a new pitch, so that measured angles that scatter about a nominal one stay one pitch.
/// With several pitches, a method uses the one nearest to the wanted incidence unless it is said to use two.
enum class Interpolation {
  nearest,          ///< the view whose line of sight makes the smallest angle with the wanted one
  linear,           ///< the two neighbours in azimuth, around the circle, weighted by distance
  rescaled_linear,  ///< the same, ranges rescaled to the wanted incidence; azimuths unchanged
  rotated_linear,   ///< the same, each turned to the wanted azimuth and incidence
  bilinear,         ///< `linear` at the pitches above and below, or the outermost, also weighted
  rotated_bilinear,  ///< `rotated_linear` at the pitches above and below
  rotated_mean,  ///< the mean of the six views nearest in azimuth, each turned as by `rotated_linear`: less speckle
  rotated_mean_bipitch  ///< `rotated_mean` at the pitches above and below, weighted by distance
};

/// "nearest view", "linear in azimuth", …: for the rows of tables.
std::string_view name(Interpolation method);

/// How values between the pixels of an image are found.
enum class Resampling {
  bilinear,  ///< of power; smooths speckle
  cubic,     ///< of amplitude, by cubic(), negative ones cut to 0; smooths speckle about half as much
};

/// Whether the method depends on the height of interpolate_view()'s plane.
bool supposes_plane(Interpolation method);

/// The methods that differ from one another on these views: `nearest`, `linear` and `rotated_linear`, or the first six
/// if the views have more than one pitch. Methods that average speckle away are listed by despeckling_for().
std::vector<Interpolation> interpolations_for(std::span<const PosedImage> training);

/// The methods that are blurred when images are speckled: `rotated_linear` and `rotated_mean`, and `rotated_mean_bipitch`
/// if the views have more than one pitch.
std::vector<Interpolation> despeckling_for(std::span<const PosedImage> training);

/// The image that `method` predicts on the grid of `wanted`, linear power.
///
/// Training images are looked up by the distances (m) from the wanted aim point along track and in range, so that sizes,
/// spacings, look sides and aim points may differ. Values between pixels are `resampling`'s, beyond the image's border 0. Turning
/// and rescaling assume that all scatterers lie on one horizontal plane, y = `plane_height_m` above the wanted aim point.
/// The plane's point that the wanted radar sees in pixel (i, j),
///
///     p = aim + y ŷ + a_i h + (g_j − r sin θ) u
///     g_j = √(R_j² − (r cos θ − y)²)   u = (−sin φ, 0, −cos φ)
///
/// is looked up where the training view sees it (project()), so range shrinks or grows by the ratio of the sines of
/// the incidences; bins nearer than the plane are 0. Values are not rescaled. For the acquisition of a training view,
/// every method but the means returns that view's image bit by bit (cubic resampling: but for rounding), unless its pitch
/// has another view at that azimuth; the bilinear methods do so only if the view's incidence is the mean of its pitch.
///
/// Throws UsageError without training images and where an image does not have the size of its acquisition;
/// GeometryError for an impossible acquisition. Cost: linear in the wanted pixels, at most two images looked up at
/// each (bilinear methods: four; means: six or twelve), rows in parallel.
Image<float> interpolate_view(std::span<const PosedImage> training, const Acquisition& wanted,
                              Interpolation method, double plane_height_m = 0.0,
                              Resampling resampling = Resampling::bilinear);

/// The height of the plane (m above the aim point) for which turned views predict each other best: the one with the
/// highest mean PSNR of `rotated_linear` on training views that are left out one at a time. For a building, the plane
/// through the aim point lies at its foot and turns walls and roof about wrong positions: a learned field that beats only
/// that baseline has shown little. Up to twelve views spread over the set are left out; heights up to half a swath above
/// and below the aim point are tried in 33 steps, then refined to a sixteenth of a step. 0 for fewer than two views and for
/// blank ones. Throws as interpolate_view(), and Interrupted when the monitor asks for it. Cost: some 500 predicted
/// views, in parallel; the training views' memory is not copied.
double fitted_plane_height_m(std::span<const PosedImage> training, const Monitor& monitor = {});

}  // namespace sarnerf

/// Baselines that a learned field is compared with: views interpolated from the training images. Free parameters of a
/// method are chosen from those images alone.
namespace sarnerf {

/// One interpolation to compare with.
struct Baseline {
  Interpolation method = Interpolation::linear;
  double plane_height_m = 0.0;  ///< see interpolate_view(); of methods that turn or rescale
  double blur_pixels = 0.0;     ///< σ of the gaussian_blur() of the result
  /// Amplitudes are averaged and blurred, and squared at the end: glints in single views then count less. Speckle of
  /// one look becomes too dark, by a factor of π/4.
  bool of_amplitudes = false;
};

/// name() of the method, with its blur, if any, whether amplitudes are averaged, and the height of its plane unless the
/// plane goes through the aim point.
std::string name(const Baseline& baseline);

/// interpolate_view(), blurred. Throws and costs as interpolate_view().
Image<float> baseline_view(std::span<const PosedImage> training, const Acquisition& wanted,
                           const Baseline& baseline);

/// The σ (pixels) among 0, 0.7, 1, 1.5 and 2 with which the baseline best predicts training views that are left out one
/// at a time, as in fitted_plane_height_m(). The truth is single, speckled views, since no other is known; predictions
/// with less speckle come closer to those, too. The smallest σ for fewer than two views and for blank ones. Throws as
/// interpolate_view(), and Interrupted when the monitor asks for it. Cost: 60 predicted views.
double fitted_blur_pixels(std::span<const PosedImage> training, const Baseline& baseline,
                          const Monitor& monitor = {});

/// The methods of interpolations_for(). Those that assume a plane appear twice: with the plane through the aim point and,
/// unless it is the same, with the one at fitted_plane_height_m(). If the images are speckled (is_speckled()), also the
/// methods of despeckling_for(), on power and on amplitudes, with fitted_blur_pixels() and both planes. None without
/// training images. Cost: that of the fits.
std::vector<Baseline> default_baselines(std::span<const PosedImage> training,
                                        const Monitor& monitor = {});

}  // namespace sarnerf

namespace sarnerf {

/// Estimates each image's shift (Acquisition::azimuth_shift_m, range_shift_m) from the images alone. Each image is
/// correlated with each of its six nearest neighbours of the same pitch, turned onto it by the level plane `plane_height_m`
/// above the aim point. The shifts are the least-squares fit to all correlations, with a Gaussian prior of standard
/// deviation `prior_pixels`, which keeps small the shifts that neighbours do not determine (those that vary slowly with
/// azimuth). The common translation is removed.
///
/// Stored pixels are never interpolated: only the acquisitions change. Nothing is estimated for a view without others at
/// its pitch. Cost: three rounds. Each takes six turned images a view, and some 50 products of images for each of them (7² at
/// the default prior), in parallel. Throws as interpolate_view(), and Interrupted when the monitor asks for it.
void register_views(std::span<PosedImage> images, double prior_pixels = kCut_pixels, double plane_height_m = 0.0,
                    const Monitor& monitor = {});

}  // namespace sarnerf
