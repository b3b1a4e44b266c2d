// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
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

/// Statistics over the background of images (find_regions()), each image relative to its own mean there, so that gains do not matter.
/// Texture and gradients of the clutter add to the variance, and look like fewer looks. Sums of groups of images can be added, so that the
/// statistics without one group need no second look at the images.
class ClutterSums {
 public:
  /// An image with a background of fewer than 100 pixels adds nothing. Cost: a blur and ten passes.
  void add(const Image<float>& power);
  /// The same, without the pixels that are not 0 in `hidden`. Throws UsageError if sizes differ.
  void add(const Image<float>& power, const Image<std::uint8_t>& hidden);
  void add(const ClutterSums& other);

  /// Empty if no image had a background.
  std::optional<ClutterStatistics> statistics() const;

 private:
  /// Sum of products of two deviations, and their number.
  struct Products {
    double sum = 0.0, n = 0.0;

    void add(const Products& other);
    double mean() const { return n > 0.0 ? sum / n : 0.0; }
  };

  void add_background(const Image<float>& power, const Image<std::uint8_t>& background);

  Products variance_;
  std::array<Products, ClutterStatistics::kLags> azimuth_, range_;
  std::size_t n_pixels_ = 0;
};

/// Those of all images together.
std::optional<ClutterStatistics> clutter_statistics(std::span<const Image<float>> powers);

/// Clutter by the product model (Ward 1981): speckle of a radar on a reflectivity τ that varies from pixel to pixel. τ is independent
/// and gamma-distributed, so that power of one look without an impulse response has a K distribution.
struct ClutterModel {
  ImageFormation radar;
  /// Variance over mean² of τ as the radar's response |h|² averages it. τ itself has 1 / Σ|h|⁴ times as much.
  double texture_variance = 0.0;
};

/// The model of images of one spacing. Power of L looks on texture of variance v has the variance (1 + v)(1 + 1 / L) − 1: up to 1, it
/// is taken for speckle alone; what exceeds 1, speckle of one look cannot have, and is texture. The resolution follows from the
/// autocorrelation of neighbours along each axis: (ρ + 2 v μ) / (1 + 2 v), with ρ = (Σ_n h_n h_{n+1})² (Goodman 1975; also that of any
/// number of looks without texture) and μ = Σ_n h_n² h_{n+1}² / Σ_n h_n⁴. It is missing where neighbours are no more correlated than the narrowest possible response
/// makes them: then pixels are independent. Texture comes out some 15 % too weak, because its brightest pixels count as targets
/// (find_regions()). Empty where clutter_statistics() are.
std::optional<ClutterModel> fitted_clutter(std::span<const Image<float>> powers, const Window& window, double azimuth_spacing_m,
                                           double range_spacing_m);

/// Multiplies a mean reflectivity without response by τ. The seed is the radar's.
void multiply_by_texture(Image<float>& reflectivity, const ClutterModel& clutter, const Acquisition& acquisition);

/// Puts speckle and texture on an image of mean power that has the radar's impulse response already: multiplies it by the image that the
/// radar makes of clutter of power 1 (F5 without noise). Where the mean reflectivity without response is known, multiply_by_texture()
/// and form_image() do the same exactly, sharp edges included. Throws and costs as form_image().
void multiply_by_clutter(Image<float>& mean_power, const ClutterModel& clutter, const Acquisition& acquisition);

}  // namespace sarnerf
