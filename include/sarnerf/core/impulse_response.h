// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sarnerf/core/window.h"

namespace sarnerf {

/// Impulse response along one axis, sampled at the pixels. Real and symmetric; its energy is 1, so that
/// an extended target keeps its mean power.
struct Kernel {
  std::vector<double> taps{1.0};   ///< h_n for n = −reach … reach
  double bandwidth_per_m = 0.0;    ///< B (cycles/m); 0: no impulse response
  double neglected_energy = 0.0;   ///< share of ∫|h|² beyond the taps, before they were normalised
  int border = 0;                  ///< pixels within which all but 1 % of the energy lies

  int reach() const { return static_cast<int>(taps.size() / 2); }

  /// Σ |h_n|² of the taps that reach pixel `index` of an axis of `count` pixels from inside of it.
  double energy_inside(int index, int count) const;
};

/// The separable impulse response of a processor. Default-constructed it leaves images alone.
struct ImpulseResponse {
  Kernel azimuth, range;
};

/// What a radar resolves, and by which weighting of its band.
struct Resolution {
  double azimuth_m = 0.0, range_m = 0.0;  ///< −3 dB widths of |h|², along track and in slant range; not the pixel spacing
  Window window;

  bool operator==(const Resolution&) const = default;
};

/// Samples h at multiples of `spacing_m`, h the transform of the window on a band B = b / ρ, with ρ =
/// `resolution_m` the −3 dB width of |h|² and b the window's broadening (F1, F3 in
/// docs/image_formation.md).
///
/// Taps reach as far as all but 1e-10 of the energy, at most 128 / B (which leaves 8e-4 of the energy out
/// without a window, 5e-5 with Taylor's). Throws UsageError when B exceeds
/// 1 / spacing: then the samples are aliases, a point's energy depends on where in its pixel it lies,
/// and no image of this spacing has this resolution.
Kernel make_kernel(const Window& window, double resolution_m, double spacing_m);

/// Both axes' kernels. Throws as make_kernel.
ImpulseResponse impulse_response(const Resolution& resolution, double azimuth_spacing_m, double range_spacing_m);

/// Pixels on every side of an image from which power leaks into it.
struct Border {
  int azimuth = 0, range = 0;
};

/// Wide enough for all but 1 % of the response's energy, at most one image of so many pixels on each side.
Border border_of(const ImpulseResponse& response, int n_azimuth, int n_range);

}  // namespace sarnerf
