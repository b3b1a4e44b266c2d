// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sarnerf {

/// Spectral weighting of a processor: what trades resolution for sidelobes.
///
/// | kind    | taper W(u), u = f/B in [−½, ½]                | parameters                          |
/// |---------|-----------------------------------------------|-------------------------------------|
/// | none    | 1                                             |                                     |
/// | hann    | 0.5 + 0.5 cos 2πu                             |                                     |
/// | hamming | 0.54 + 0.46 cos 2πu                           |                                     |
/// | taylor  | 1 + 2 Σ_{m<n̄} F_m cos 2πmu                    | sidelobe_db (below zero), nbar      |
/// | kaiser  | I₀(β √(1 − 4u²)) / I₀(β)                      | beta                                |
///
/// F_m are those of T. T. Taylor (1955) for n̄ nearly equal sidelobes (F2 in docs/image_formation.md).
struct Window {
  enum class Kind { none, hann, hamming, taylor, kaiser };
  Kind kind = Kind::none;
  double sidelobe_db = -35.0;
  int nbar = 4;
  double beta = 0.0;

  bool operator==(const Window&) const = default;
};

/// "taylor:-35", "taylor:-35,5", "kaiser:6", "hamming", "hann", "none". Throws UsageError listing these,
/// and for parameters that make no window: a sidelobe level outside −100 … −14 dB, n̄ outside 2 … 30 or
/// too small for the level (missed by more than 2 dB, or a negative taper), β outside 0 … 50.
Window window_from_text(std::string_view text);

/// The inverse; every parameter is spelled out: "taylor:-35,4".
std::string text_of(const Window& window);

/// The window's taper and its transform, the impulse response of a band of width B at t = x B (x in
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

}  // namespace sarnerf
