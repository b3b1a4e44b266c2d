// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/impulse_response.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

#include "sarnerf/core/error.h"
#include "sarnerf/core/image_analysis.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

namespace {

double sinc(double t) { return t == 0.0 ? 1.0 : std::sin(kPi * t) / (kPi * t); }

std::vector<double> taylor_cosines(double sidelobe_db, int nbar) {
  const double a = std::acosh(std::pow(10.0, std::abs(sidelobe_db) / 20.0)) / kPi;
  const double half = double(nbar) - 0.5;
  const double dilation2 = double(nbar) * double(nbar) / (a * a + half * half);
  std::vector<double> cosines{1.0};
  for (int m = 1; m < nbar; ++m) {
    const double m2 = double(m) * double(m);
    double numerator = 1.0, denominator = 1.0;
    for (int n = 1; n < nbar; ++n) {
      numerator *= 1.0 - m2 / (dilation2 * (a * a + (n - 0.5) * (n - 0.5)));
      if (n != m) denominator *= 1.0 - m2 / (double(n) * double(n));
    }
    // 2 F_m, with F_m = ± numerator / (2 denominator).
    cosines.push_back((m % 2 == 1 ? 1.0 : -1.0) * numerator / denominator);
  }
  return cosines;
}

std::vector<double> cosines_of(const Window& window) {
  switch (window.kind) {
    case Window::Kind::none: return {1.0};
    case Window::Kind::hann: return {0.5, 0.5};
    case Window::Kind::hamming: return {0.54, 0.46};
    case Window::Kind::taylor: return taylor_cosines(window.sidelobe_db, window.nbar);
    case Window::Kind::kaiser: break;
  }
  return {};
}

}  // namespace

Taper::Taper(const Window& window) : cosines_(cosines_of(window)), beta_(window.beta) {
  if (cosines_.empty()) scale_ = 1.0 / std::cyl_bessel_i(0.0, beta_);

  // Simpson on half the band; the integrand is smooth up to the edge.
  constexpr int kSteps = 2000;
  for (int n = 0; n <= kSteps; ++n) {
    const double weight_here = weight(0.5 * n / kSteps);
    const double rule = n == 0 || n == kSteps ? 1.0 : n % 2 == 1 ? 4.0 : 2.0;
    energy_ += rule * weight_here * weight_here / (3.0 * kSteps);
  }

  double inside = 0.0, outside = 0.5;
  const double half_power = 0.5 * response(0.0) * response(0.0);
  while (response(outside) * response(outside) > half_power) outside += 0.25;
  while (outside - inside > 1e-12) {
    const double middle = 0.5 * (inside + outside);
    (response(middle) * response(middle) > half_power ? inside : outside) = middle;
  }
  broadening_ = inside + outside;
}

double Taper::weight(double u) const {
  if (std::abs(u) > 0.5) return 0.0;
  if (cosines_.empty()) return scale_ * std::cyl_bessel_i(0.0, beta_ * std::sqrt(std::max(0.0, 1.0 - 4.0 * u * u)));
  double sum = 0.0;
  for (std::size_t m = 0; m < cosines_.size(); ++m) sum += cosines_[m] * std::cos(2.0 * kPi * double(m) * u);
  return sum;
}

double Taper::response(double t) const {
  if (cosines_.empty()) {
    const double square = beta_ * beta_ - kPi * kPi * t * t;
    const double root = std::sqrt(std::abs(square));
    if (root < 1e-6) return scale_;
    return scale_ * (square > 0.0 ? std::sinh(root) : std::sin(root)) / root;
  }
  double sum = cosines_[0] * sinc(t);
  for (std::size_t m = 1; m < cosines_.size(); ++m) {
    sum += 0.5 * cosines_[m] * (sinc(t - double(m)) + sinc(t + double(m)));
  }
  return sum;
}

double Taper::peak_sidelobe_db() const {
  constexpr double kStep = 1.0 / 256.0;
  const auto power = [&](int n) { return std::pow(response(kStep * n), 2); };
  int n = 1;
  while (power(n + 1) < power(n)) ++n;  // down the main lobe
  const int last = n + static_cast<int>(40.0 / kStep);
  double highest = 0.0;
  for (; n <= last; ++n) highest = std::max(highest, power(n));
  return 10.0 * std::log10(highest / power(0));
}

namespace {

/// A Taylor window's sidelobes are not quite as low as designed; this is the tolerance.
constexpr double kMostExcessDb = 2.0;

[[noreturn]] void fail(std::string_view text) {
  throw UsageError("--window: expected none, hann, hamming, taylor:DB (such as taylor:-35, or "
                   "taylor:-35,5 with its number of sidelobes) or kaiser:BETA, found '" +
                   std::string(text) + "'");
}

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

bool becomes_negative(const Window& window) {
  const Taper taper(window);
  for (int n = 0; n <= 500; ++n) {
    if (taper.weight(n * 1e-3) < 0.0) return true;
  }
  return false;
}

Window taylor(std::string_view text, std::string_view parameters) {
  Window window;
  window.kind = Window::Kind::taylor;
  const auto comma = parameters.find(',');
  const auto level = number(parameters.substr(0, comma));
  if (!level) fail(text);
  window.sidelobe_db = *level;
  if (comma != std::string_view::npos) {
    const auto nbar = number(parameters.substr(comma + 1));
    if (!nbar || *nbar != std::floor(*nbar) || *nbar < 2.0 || *nbar > 30.0) {
      throw UsageError("--window: expected a whole number of sidelobes from 2 to 30 after the level, as in "
                       "taylor:-35,5, found '" + std::string(text) + "'");
    }
    window.nbar = static_cast<int>(*nbar);
  }
  if (!(*level >= -100.0 && *level <= -14.0)) {
    throw UsageError("--window: expected a sidelobe level of -100 to -14 dB (no window has -13.3 dB), found '" +
                     std::string(text) + "'");
  }
  const double reached_db = Taper(window).peak_sidelobe_db();
  if (becomes_negative(window) || reached_db > *level + kMostExcessDb) {
    char reached[32];
    std::snprintf(reached, sizeof reached, "%.1f", reached_db);
    throw UsageError("--window: " + text_of(window) + " needs more equal sidelobes (nbar) for its level: it reaches " +
                     reached + " dB; give it more, as in taylor:" + number_text(*level) + "," +
                     std::to_string(window.nbar + 2));
  }
  return window;
}

}  // namespace

Window window_from_text(std::string_view text) {
  Window window;
  if (text == "none") return window;
  if (text == "hann") {
    window.kind = Window::Kind::hann;
  } else if (text == "hamming") {
    window.kind = Window::Kind::hamming;
  } else if (text.starts_with("taylor:")) {
    return taylor(text, text.substr(7));
  } else if (text.starts_with("kaiser:")) {
    const auto beta = number(text.substr(7));
    if (!beta) fail(text);
    if (!(*beta >= 0.0 && *beta <= 50.0)) {
      throw UsageError("--window: expected a beta from 0 to 50, as in kaiser:6, found '" + std::string(text) +
                       "'");
    }
    window.kind = Window::Kind::kaiser;
    window.beta = *beta;
  } else {
    fail(text);
  }
  return window;
}

std::string text_of(const Window& window) {
  switch (window.kind) {
    case Window::Kind::none: return "none";
    case Window::Kind::hann: return "hann";
    case Window::Kind::hamming: return "hamming";
    case Window::Kind::taylor:
      return "taylor:" + number_text(window.sidelobe_db) + "," + std::to_string(window.nbar);
    case Window::Kind::kaiser: return "kaiser:" + number_text(window.beta);
  }
  return {};
}

namespace {

/// Fraction of the energy beyond the taps. Amplitudes go as its root, so autocorrelations are right to 2e-5 where the
/// window decays fast enough.
constexpr double kNeglected = 1e-10;
constexpr double kMostCells = 128.0;
constexpr double kBorderShare = 0.01;
/// No image is wider, so taps beyond would never be used.
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
  // A resolution of exactly b spacings is critical sampling. It is accepted, with a margin for rounding.
  if (step > 1.0 + 1e-9) refuse_under_sampling(window, taper.broadening(), resolution_m, spacing_m);

  const int most = static_cast<int>(std::min<double>(kMostTaps, std::ceil(kMostCells / step)));
  std::vector<double> half;
  double kept = 0.0;
  Kernel kernel;
  kernel.bandwidth_per_m = taper.broadening() / resolution_m;
  // By Parseval's theorem the samples of a response within the band 1/spacing hold the energy of the
  // response itself: the energy that is missing from the sum lies beyond the taps.
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

namespace {

constexpr std::size_t kRowsAtOnce = 4;

/// The impulse response of mean power: |h_n|².
std::vector<double> power_taps(const Kernel& kernel) {
  std::vector<double> taps = kernel.taps;
  for (double& tap : taps) tap *= tap;
  return taps;
}

}  // namespace

void convolve_power(Image<float>& power, const ImpulseResponse& response, const Monitor& monitor) {
  const std::vector<double> along_range = power_taps(response.range);
  const std::vector<double> along_azimuth = power_taps(response.azimuth);
  const auto n_azimuth = static_cast<std::size_t>(power.n_azimuth());
  const auto width = static_cast<std::size_t>(power.n_range());
  Plane plane(power.n_azimuth(), power.n_range());
  parallel_for(n_azimuth, kRowsAtOnce, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    std::vector<double> row(width);
    for (std::size_t n = begin; n < end; ++n) {
      const int i = static_cast<int>(n);
      std::fill(row.begin(), row.end(), 0.0);
      for (int j = 0; j < power.n_range(); ++j) {
        if (power(i, j) == 0.0f) continue;
        plane.row_used[n] = 1;
        spread(double{power(i, j)}, along_range, j, row);
      }
      for (std::size_t j = 0; j < width; ++j) plane.values.row(i)[j] = static_cast<float>(row[j]);
    }
  });
  parallel_for(n_azimuth, kRowsAtOnce, [&](std::size_t begin, std::size_t end, int) {
    monitor.check();
    std::vector<double> row(width);
    for (std::size_t n = begin; n < end; ++n) {
      const int i = static_cast<int>(n);
      gather_rows(plane, along_azimuth, i, row);
      for (std::size_t j = 0; j < width; ++j) power.row(i)[j] = static_cast<float>(row[j]);
    }
  });
}

}  // namespace sarnerf
