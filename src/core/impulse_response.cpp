// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/impulse_response.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "sarnerf/core/error.h"
#include "sarnerf/core/format.h"

namespace sarnerf {
namespace {

/// Amplitudes go as its root: autocorrelations are then right to 2e-5 where the window decays fast enough.
constexpr double kNeglected = 1e-10;
constexpr double kMostCells = 128.0;
constexpr double kBorderShare = 0.01;
/// No image is wider; taps beyond would never be used.
constexpr int kMostTaps = 65535;

void refuse_under_sampling(const Window& window, double broadening, double resolution_m,
                           double spacing_m) {
  char text[320];
  std::snprintf(text, sizeof text,
                "a spacing of %.4g m under-samples a resolution of %.4g m with window %s: its band needs "
                "pixels of at most %.4g m; choose a finer spacing or a resolution of at least %.4g m",
                spacing_m, resolution_m, text_of(window).c_str(), resolution_m / broadening,
                spacing_m * broadening);
  throw UsageError(text);
}

}  // namespace

Kernel make_kernel(const Window& window, double resolution_m, double spacing_m) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (!positive(resolution_m) || !positive(spacing_m)) {
    throw UsageError("an impulse response needs a resolution and a spacing above zero, found " +
                     format("%.6g and %.6g m", resolution_m, spacing_m));
  }
  const Taper taper(window);
  const double step = taper.broadening() * spacing_m / resolution_m;  // in units of 1/B
  // A resolution of exactly b spacings is critical sampling and fine, rounding or not.
  if (step > 1.0 + 1e-9) refuse_under_sampling(window, taper.broadening(), resolution_m, spacing_m);

  const int most = static_cast<int>(std::min<double>(kMostTaps, std::ceil(kMostCells / step)));
  std::vector<double> half;
  double kept = 0.0;
  Kernel kernel;
  kernel.bandwidth_per_m = taper.broadening() / resolution_m;
  // By Parseval's theorem the samples of a response within the band 1/spacing hold the energy of the
  // response itself: what is missing from the sum lies beyond it.
  const double total = taper.energy() / step;
  for (int n = 0; n <= most; ++n) {
    half.push_back(taper.response(n * step));
    kept += (n == 0 ? 1.0 : 2.0) * half.back() * half.back();
    if (kept < (1.0 - kBorderShare) * total) kernel.border = n + 1;
    if (kept >= (1.0 - kNeglected) * total) break;
  }
  kernel.border = std::min(kernel.border, most);
  kernel.neglected_energy = std::max(0.0, 1.0 - kept / total);
  const double scale = 1.0 / std::sqrt(kept);
  kernel.taps.assign(half.rbegin(), half.rend());
  kernel.taps.insert(kernel.taps.end(), half.begin() + 1, half.end());
  for (double& tap : kernel.taps) tap *= scale;
  return kernel;
}

ImpulseResponse impulse_response(const Resolution& r, double azimuth_spacing_m, double range_spacing_m) {
  ImpulseResponse response;
  response.azimuth = make_kernel(r.window, r.azimuth_m, azimuth_spacing_m);
  const bool same = r.azimuth_m == r.range_m && azimuth_spacing_m == range_spacing_m;
  response.range = same ? response.azimuth : make_kernel(r.window, r.range_m, range_spacing_m);
  return response;
}

double Kernel::energy_inside(int index, int count) const {
  const int r = reach();
  double energy = 0.0;
  for (int n = std::max(-r, index - count + 1); n <= std::min(r, index); ++n) {
    const double tap = taps[static_cast<std::size_t>(n + r)];
    energy += tap * tap;
  }
  return energy;
}

Border border_of(const ImpulseResponse& response, int n_azimuth, int n_range) {
  return {std::min(response.azimuth.border, n_azimuth), std::min(response.range.border, n_range)};
}

}  // namespace sarnerf
