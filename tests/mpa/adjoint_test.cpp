// SPDX-License-Identifier: Apache-2.0
// The oracle's adjoint against central differences of its forward pass, both in double.
#include <algorithm>
#include <cmath>

#include "catch.h"
#include "random_batch.h"
#include "sarnerf/mpa/integrate.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// L = Σ g · pixel: any loss has this form in the neighbourhood of an image.
double loss(const Problem<double>& p, Integrator integrator, const std::vector<double>& g) {
  std::vector<double> pixels(p.n_pixels(), 0.0);
  oracle::integrate(p.segments(), p.field(), integrator, p.n_range, pixels);
  double sum = 0.0;
  for (std::size_t n = 0; n < g.size(); ++n) sum += g[n] * pixels[n];
  return sum;
}

/// Richardson's combination of two central differences: error O(h⁴), rounding far below 1e-6.
template <class SetValue>
double derivative(Problem<double>& p, Integrator integrator, const std::vector<double>& g,
                  double at, SetValue&& set_value) {
  const double h = 1e-3 * std::max(1e-2, std::abs(at));
  const auto slope = [&](double step) {
    set_value(at + step);
    const double ahead = loss(p, integrator, g);
    set_value(at - step);
    const double behind = loss(p, integrator, g);
    return (ahead - behind) / (2.0 * step);
  };
  const double coarse = slope(2.0 * h), fine = slope(h);
  set_value(at);
  return fine + (fine - coarse) / 3.0;
}

void check_all(Problem<double>& p, Integrator integrator) {
  std::vector<double> g(p.n_pixels());
  for (std::size_t n = 0; n < g.size(); ++n) g[n] = std::cos(1.0 + 3.0 * static_cast<double>(n));
  GradientArrays<double> found(p);
  oracle::integrate_adjoint(p.segments(), p.field(), integrator, p.n_range, g, found.spans());

  const auto compare = [&](std::vector<double>& values, const std::vector<double>& gradient) {
    double scale = 0.0;
    for (double value : gradient) scale = std::max(scale, std::abs(value));
    for (std::size_t s = 0; s < values.size(); ++s) {
      const double expected =
          derivative(p, integrator, g, values[s], [&](double v) { values[s] = v; });
      INFO(name(integrator) << " segment " << s << ": " << gradient[s] << ", by differences "
                            << expected);
      CHECK(std::abs(gradient[s] - expected) <= 1e-6 * std::abs(expected) + 1e-9 * scale);
    }
  };
  compare(p.extinction, found.extinction);
  compare(p.extinction_back, found.extinction_back);
  compare(p.source, found.source);
}

}  // namespace

TEST_CASE("the adjoint is the derivative") {
  for (Integrator integrator : kAllIntegrators) {
    for (SourceForm form : kBothForms) {
      for (bool two_extinctions : {false, true}) {
        Problem<double> p = random_problem(11, 4, 9, 3.0, two_extinctions, form).as<double>();
        check_all(p, integrator);
      }
    }
  }
}

TEST_CASE("the adjoint is the derivative from transparent to opaque segments") {
  for (Integrator integrator : kAllIntegrators) {
    for (SourceForm form : kBothForms) {
      for (double depth : {1e-4, 0.0099, 0.0101, 0.1, 0.499, 0.501, 1.0, 3.0, 12.0}) {
        Problem<double> p;
        p.n_rows = 1;
        p.n_range = 3;
        p.form = form;
        for (std::uint32_t j = 0; j < 3; ++j) p.add_segment(j, 0.5, depth, 0.6);
        p.end_ray(0);
        check_all(p, integrator);
      }
    }
  }
}
