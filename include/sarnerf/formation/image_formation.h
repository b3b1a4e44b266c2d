// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/core/impulse_response.h"

namespace sarnerf {

/// How radar and processor turn the mean reflectivity into an image. Default-constructed, it changes nothing.
struct ImageFormation {
  /// −3 dB widths of |h|² (m), azimuth and slant range; not the pixel spacing. Empty: no impulse response,
  /// and speckle and noise are independent from pixel to pixel.
  std::optional<std::pair<double, double>> resolution_m;
  Window window;
  /// Equivalent number of looks (ENL) of the speckle, 1 … 1000; infinity: no speckle. Looks are independent
  /// realisations of the full band, not sub-bands: averaging them does not change the resolution.
  double looks = std::numeric_limits<double>::infinity();
  std::optional<double> nesz_db;  ///< noise-equivalent σ⁰
  std::uint64_t seed = 1;         ///< of the random numbers of speckle and noise

  bool speckle() const { return looks < std::numeric_limits<double>::infinity(); }
  bool any() const { return resolution_m || speckle() || nesz_db; }
};

/// Throws UsageError for invalid settings: looks below 1, above 1000 or not a number, a window without
/// a resolution, a noise level outside ±300 dB, a resolution that the spacings (m) under-sample.
void validate(const ImageFormation& formation, double azimuth_spacing_m, double range_spacing_m);

/// The kernels of both axes; without a resolution each is a single tap of 1.
ImpulseResponse impulse_response(const ImageFormation& formation, double azimuth_spacing_m,
                                 double range_spacing_m);

/// Weights a_m of independent looks with Σ a_m = 1 and 1 / Σ a_m² = `looks` (F6): ⌈looks⌉ of them, all
/// equal except the last.
std::vector<double> look_weights(double looks);

/// Forms the image in place (F4, F5, F7 in docs/guide/image_formation.md): `beta0` is the mean reflectivity
/// [n_azimuth × n_range], linear power, and becomes β⁰ as a radar of this resolution, speckle and noise
/// measures it:
///
///     without speckle   |h|² ⊛ β⁰ + N_j
///     with speckle      Σ_m a_m |h ⊛ (√β⁰ w_m) + n_m|²,   w_m white complex Gaussian of unit variance
///
/// N_j = NESZ / sin θ_j is the noise power, n_m noise of that power after the same filter, and
/// cos θ_j = H / r_j with H the radar's height above `reference_height_m` (world). Scatterers lie at the
/// centres of their pixels. No power enters from beyond the image's borders, and power that leaks out is lost;
/// the noise is stationary up to the borders.
///
/// Equal reflectivity, pose (azimuth and incidence) and seed give equal pixels, whatever the number of
/// threads. Returns the number of bins nearer than H, which have no incidence and get no noise (0 if no noise
/// is asked for). Throws like validate, GeometryError for noise with a radar below the plane, and UsageError
/// when image and acquisition differ in size.
///
/// Cost: O(pixels × taps), because the filters are separable and real: one pass of each without speckle, two a
/// look with speckle, and as much again for noise. Pixels and rows of no power are skipped. Memory: see
/// formation_bytes_per_pixel. Nothing is computed or allocated when `formation.any()` is false.
int form_image(Image<float>& beta0, const ImageFormation& formation, const Acquisition& acquisition,
               double reference_height_m, const Monitor& monitor = {});

/// Bytes per pixel that form_image allocates beside the image.
std::uint64_t formation_bytes_per_pixel(const ImageFormation& formation);

}  // namespace sarnerf
