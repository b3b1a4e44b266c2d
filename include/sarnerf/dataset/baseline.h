// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "sarnerf/core/monitor.h"
#include "sarnerf/dataset/posed_image.h"
#include "sarnerf/dataset/view_interpolation.h"

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
