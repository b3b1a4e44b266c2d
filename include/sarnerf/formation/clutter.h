// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>

#include "sarnerf/core/image.h"
#include "sarnerf/core/impulse_response.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/formation/image_formation.h"

/// Speckle of measured images: what it is like, and how to put the same speckle on images that have none.
namespace sarnerf {

/// Second-order statistics of the clutter of power images.
struct ClutterStatistics {
  static constexpr int kLags = 4;

  double looks = 0.0;  ///< mean² / variance
  /// Autocorrelation of power at 1 to kLags pixels along track and in slant range: covariance over variance.
  std::array<double, kLags> azimuth{}, range{};
  std::size_t n_pixels = 0;
};

/// Statistics over the background of the images (find_regions()), each image relative to its own mean there, so that gains do not
/// matter. Texture and gradients of the clutter add to the variance, and look like fewer looks. Empty where no image has a background
/// of 100 pixels. Cost: a blur and ten passes over each image.
std::optional<ClutterStatistics> clutter_statistics(std::span<const Image<float>> powers);

/// The resolution of a radar with this window whose speckle has the measured autocorrelation of neighbours. For fully developed
/// speckle with the impulse response h of energy 1, the autocorrelation of power at k pixels is (Σ_n h_n h_{n+k})² (Goodman 1975),
/// along each axis, for any number of looks. Empty where neighbours along an axis are no more correlated than the sampling of the
/// narrowest possible response makes them: then speckle is independent from pixel to pixel.
std::optional<Resolution> fitted_resolution(const ClutterStatistics& clutter, const Window& window, double azimuth_spacing_m,
                                            double range_spacing_m);

/// The speckle of images of one spacing: looks and resolution of their clutter. Texture makes speckle of one look appear to have fewer;
/// looks are within 1 and 1000. Empty where clutter_statistics() are.
std::optional<ImageFormation> fitted_speckle(std::span<const Image<float>> powers, const Window& window, double azimuth_spacing_m,
                                             double range_spacing_m);

/// Puts speckle on an image of mean power that has the radar's impulse response already: multiplies it by the image that a radar of
/// this formation makes of uniform clutter of power 1 (F5 without noise). Where the mean reflectivity without response is known,
/// form_image() does the same exactly, sharp edges included. Throws and costs as form_image().
void multiply_by_speckle(Image<float>& mean_power, const ImageFormation& formation, const Acquisition& acquisition);

}  // namespace sarnerf
