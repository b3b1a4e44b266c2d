// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/window.h"

#include <algorithm>
#include <cmath>

#include "sarnerf/core/units.h"

namespace sarnerf {
namespace {

double sinc(double t) { return t == 0.0 ? 1.0 : std::sin(kPi * t) / (kPi * t); }

/// I₀ by its power series: every term is positive, so nothing cancels.
double bessel_i0(double x) {
  double term = 1.0, sum = 1.0;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= 0.25 * x * x / (double(k) * double(k));
    sum += term;
  }
  return sum;
}

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
  if (cosines_.empty()) scale_ = 1.0 / bessel_i0(beta_);

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
  if (cosines_.empty()) return scale_ * bessel_i0(beta_ * std::sqrt(std::max(0.0, 1.0 - 4.0 * u * u)));
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

}  // namespace sarnerf
