// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sarnerf/core/image.h"
#include "sarnerf/core/parallel.h"

namespace sarnerf {

/// Spectral weighting of a processor: it lowers sidelobes at the cost of resolution.
///
/// | kind    | taper W(u), u = f/B in [−½, ½]                | parameters                          |
/// |---------|-----------------------------------------------|-------------------------------------|
/// | none    | 1                                             |                                     |
/// | hann    | 0.5 + 0.5 cos 2πu                             |                                     |
/// | hamming | 0.54 + 0.46 cos 2πu                           |                                     |
/// | taylor  | 1 + 2 Σ_{m<n̄} F_m cos 2πmu                    | sidelobe_db (below zero), nbar      |
/// | kaiser  | I₀(β √(1 − 4u²)) / I₀(β)                      | beta                                |
///
/// F_m are those of T. T. Taylor (1955) for n̄ nearly equal sidelobes (F2 in docs/guide/image_formation.md).
struct Window {
  enum class Kind { none, hann, hamming, taylor, kaiser };
  Kind kind = Kind::none;
  double sidelobe_db = -35.0;
  int nbar = 4;
  double beta = 0.0;

  bool operator==(const Window&) const = default;
};

/// "taylor:-35", "taylor:-35,5", "kaiser:6", "hamming", "hann", "none". Throws UsageError that lists these for any
/// other text, and UsageError for invalid parameters: a sidelobe level outside −100 … −14 dB, n̄ outside 2 … 30 or
/// too small for the level (missed by more than 2 dB, or a negative taper), β outside 0 … 50.
Window window_from_text(std::string_view text);

/// The inverse of window_from_text(), with all parameters: "taylor:-35,4".
std::string text_of(const Window& window);

/// The window's taper and its Fourier transform, the impulse response of a band of width B at t = x B (x in
/// metres, B in cycles/m). The response is real, because the taper is symmetric about the band's centre.
class Taper {
 public:
  explicit Taper(const Window& window);

  /// W(u); 0 outside [−½, ½].
  double weight(double u) const;

  /// h(t) = ∫ W(u) e^{2πiut} du, in closed form: sums of sinc, for Kaiser sinh and sin.
  double response(double t) const;

  /// ∫ W² du = ∫ h² dt.
  double energy() const { return energy_; }

  /// b: the −3 dB width of |h|² in units of 1/B, found by bisection to 1e-12. A resolution ρ needs the
  /// bandwidth B = b / ρ.
  double broadening() const { return broadening_; }

  /// Highest sidelobe of |h|² relative to its peak (dB), searched over the first 40 sidelobes.
  double peak_sidelobe_db() const;

 private:
  std::vector<double> cosines_;  ///< W as Σ c_m cos 2πmu; empty for Kaiser
  double beta_ = 0.0, scale_ = 1.0;
  double energy_ = 0.0, broadening_ = 0.0;
};

/// Impulse response along one axis, sampled at the pixels. Real and symmetric; its energy is 1, so that
/// an extended target keeps its mean power.
struct Kernel {
  std::vector<double> taps{1.0};   ///< h_n for n = −reach … reach
  double bandwidth_per_m = 0.0;    ///< B (cycles/m); 0: no impulse response
  double neglected_energy = 0.0;   ///< fraction of ∫|h|² beyond the taps, before they were normalised
  int border = 0;                  ///< distance from the centre (pixels) within which all but 1 % of the energy lies

  int reach() const { return static_cast<int>(taps.size() / 2); }

  /// Σ |h_n|² over the taps that reach pixel `index` from pixels [0, count) of an axis.
  double energy_inside(int index, int count) const;
};

/// The separable impulse response of a processor. Default-constructed, it leaves images unchanged.
struct ImpulseResponse {
  Kernel azimuth, range;
};

/// Resolution of a radar, and the weighting of its band.
struct Resolution {
  double azimuth_m = 0.0, range_m = 0.0;  ///< −3 dB widths of |h|², along track and in slant range; not the pixel spacing
  Window window;

  bool operator==(const Resolution&) const = default;
};

/// Samples h at multiples of `spacing_m`, h the transform of the window on a band B = b / ρ, with ρ =
/// `resolution_m` the −3 dB width of |h|² and b the window's broadening (F1, F3 in
/// docs/guide/image_formation.md).
///
/// The taps hold all but 1e-10 of the energy, but reach at most 128 / B (which leaves out 8e-4 of the energy
/// without a window, 5e-5 with Taylor's). Throws UsageError when B exceeds 1 / spacing: then the samples are
/// aliased, a point's energy depends on its position within its pixel, and no image of this spacing has this
/// resolution.
Kernel make_kernel(const Window& window, double resolution_m, double spacing_m);

/// The kernels of both axes. Throws as make_kernel().
ImpulseResponse impulse_response(const Resolution& resolution, double azimuth_spacing_m, double range_spacing_m);

/// Pixels on every side of an image from which power leaks into it.
struct Border {
  int azimuth = 0, range = 0;
};

/// Wide enough for all but 1 % of the response's energy, but at most the image's own size on each side.
Border border_of(const ImpulseResponse& response, int n_azimuth, int n_range);

/// The image without a border on every side; pixels must remain.
template <class T>
Image<T> without_border(Image<T> image, const Border& border) {
  if (border.azimuth == 0 && border.range == 0) return image;
  Image<T> inside(image.n_azimuth() - 2 * border.azimuth, image.n_range() - 2 * border.range);
  for (int i = 0; i < inside.n_azimuth(); ++i) {
    const auto from = image.row(i + border.azimuth).subspan(static_cast<std::size_t>(border.range), inside.row(i).size());
    std::copy(from.begin(), from.end(), inside.row(i).begin());
  }
  return inside;
}

/// Convolves the mean power with |h_n|², in place (F4 in docs/guide/image_formation.md). Pixels beyond the border are 0, and
/// power that leaks out is lost. The operator is symmetric, so it is its own adjoint.
///
/// The result is the same, bit by bit, for any number of threads and instruction set. Cost: O(pixels × taps); rows and
/// pixels without power are skipped. Values may be negative.
void convolve_power(Image<float>& power, const ImpulseResponse& response, const Monitor& monitor = {});

}  // namespace sarnerf
