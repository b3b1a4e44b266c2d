// SPDX-License-Identifier: Apache-2.0
// Adjoints where depths are extreme, against quadruple precision; that reference against central differences
// of whole images.
#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.h"
#include "matrix.h"
#include "mpa_reference.h"
#include "sarnerf/mpa/integrate.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {


std::vector<double> pixel_gradients(std::size_t n) {
  std::vector<double> g(n);
  for (std::size_t i = 0; i < n; ++i) g[i] = std::cos(1.0 + 3.0 * static_cast<double>(i));
  return g;
}

/// Error of a derivative relative to the size of the terms of which it is the sum. Beyond float32 it saturates.
double gradient_error(double found, Quad expected, Quad size) {
  const Quad limit = kLargestFloat;
  const Quad bounded = expected > limit ? limit : expected < -limit ? -limit : expected;
  const Quad smallest = std::numeric_limits<float>::min();
  const Quad scale = size > limit ? limit : size > smallest ? size : smallest;
  return as_double((Quad(found) - bounded) / scale);
}

template <class T, class Adjoint>
double worst_gradient_error(const Problem<T>& p, const Problem<float>& single, const ReferenceGradients& expected,
                            const Adjoint& adjoint) {
  GradientArrays<T> found(p);
  adjoint(found.spans());
  const bool two_extinctions = !p.extinction_back.empty();
  double worst = 0.0;
  // A NaN must not lose against a number.
  const auto add = [&](double error) {
    worst = std::isfinite(error) ? std::max(worst, std::abs(error)) : std::numeric_limits<double>::infinity();
  };
  for (std::size_t s = 0; s < p.n_segments(); ++s) {
    const Quad length = single.length_m[s];
    const Quad forth = two_extinctions ? length : 2 * length;
    add(gradient_error(double(found.source[s]), expected.by_source[s], quad_abs(expected.by_source[s])));
    add(gradient_error(double(found.extinction[s]), forth * expected.by_depth[s],
                       forth * expected.size_by_depth[s]));
    if (!two_extinctions) continue;
    add(gradient_error(double(found.extinction_back[s]), length * expected.by_depth[s],
                       length * expected.size_by_depth[s]));
  }
  return worst;
}

void check_gradients_of(Case row, Problem<float> p) {
  const std::vector<double> g = pixel_gradients(p.n_pixels());
  for (const Integrator integrator : kAllIntegrators) {
    for (const SourceForm form : kBothForms) {
      p.form = form;
      INFO(name(integrator) << (form == SourceForm::brightness ? " brightness" : " scattering"));
      const ReferenceGradients expected = reference_gradients(p, integrator, g);
      for (const InstructionSet set : available_instruction_sets()) {
        const double error = worst_gradient_error(p, p, expected, [&](const FieldGradients<float>& out) {
          integrate_adjoint(p.segments(), p.field(), integrator, p.n_range, g, out, set);
        });
        record(row, error);
        CHECK(error <= 2e-7);  // of which 6e-8 is the rounding to float32
      }
      const Problem<double> q = p.as<double>();
      // The oracle's gradients do not saturate; compare what float32 can hold.
      const double error = worst_gradient_error(q, p, expected, [&](const FieldGradients<double>& out) {
        oracle::integrate_adjoint(q.segments(), q.field(), integrator, q.n_range, g, out);
        for (auto part : {out.extinction_per_m, out.extinction_back_per_m, out.source}) {
          for (double& d : part) d = std::clamp(d, -kLargestFloat, kLargestFloat);
        }
      });
      record(Case::oracle, error);
      CHECK(error <= 1e-12);
    }
  }
}

Problem<float> two_extinctions_of(Problem<float> p) {
  for (std::size_t s = 0; s < p.n_segments(); ++s) {
    p.extinction_back.push_back(p.extinction[s] * (s % 3 == 0 ? 0.0f : 0.25f));
  }
  return p;
}

/// Rays that meet depths of 10 to the power of whole numbers in a shuffled order.
Problem<float> stiff_problem() {
  Problem<float> p;
  p.n_range = 12;
  for (std::uint32_t ray = 0; ray < 61; ++ray) {
    for (std::uint32_t j = 0; j < 12; ++j) {
      const int power = static_cast<int>((ray * 7 + j * 23) % 61) - 30;
      // Every other ray without anything opaque, so that all of it counts.
      const double depth = std::pow(10.0, ray % 2 == 0 ? power : std::min(power, 0));
      p.add_segment(j, 0.3f, static_cast<float>(depth / 0.6), j % 5 == 4 ? 0.0f : 0.5f + 0.1f * static_cast<float>(j));
    }
    p.end_ray(ray);
  }
  p.n_rows = 61;
  return p;
}

}  // namespace

TEST_CASE("the adjoint from 1e-30 to 1e30", "[core]") {
  check_gradients_of(Case::adjoint, stiff_problem());
  check_gradients_of(Case::adjoint, two_extinctions_of(stiff_problem()));
}

TEST_CASE("the adjoint of denormal and huge numbers is finite and right", "[core]") {
  const float values[] = {0.0f, 1.4e-45f, 1e-38f, 1e-19f, 1.0f, 1e19f, 3e38f};
  Problem<float> p;
  p.n_range = 3;
  for (const float length : values) {
    for (const float kappa : values) {
      for (const float source : values) {
        p.add_segment(0, length, kappa, source);
        p.add_segment(1, 0.5f, 1.0f, 1.0f);
        p.add_segment(2, kappa, source, length);
        p.end_ray(static_cast<std::uint32_t>(p.n_rows++));
      }
    }
  }
  check_gradients_of(Case::adjoint, p);
}

TEST_CASE("the adjoint of a ray of 10,000 bins", "[core]") {
  Problem<float> p;
  p.n_rows = 1;
  p.n_range = 10000;
  for (std::uint32_t j = 0; j < 10000; ++j) p.add_segment(j, 0.3f, 0.002f, 0.5f + 0.5f * static_cast<float>(j % 7));
  p.end_ray(0);
  check_gradients_of(Case::adjoint, p);
}

TEST_CASE("behind an opaque cell nothing has a gradient, and the cell itself has that of its closed form", "[core]") {
  constexpr float kOpaque = 2000.0f, kLength = 0.5f;
  for (const InstructionSet set : available_instruction_sets()) {
    for (const SourceForm form : kBothForms) {
      Problem<float> p;
      p.n_rows = 1;
      p.n_range = 8;
      p.form = form;
      p.add_segment(0, kLength, 0.0f, 0.0f);
      p.add_segment(1, kLength, kOpaque, 3.0f);
      for (std::uint32_t j = 2; j < 8; ++j) p.add_segment(j, kLength, j % 2 == 0 ? 0.1f : 1e30f, 1e6f);
      p.end_ray(0);
      const std::vector<double> g(8, 2.0);
      GradientArrays<float> found(p);
      integrate_adjoint(p.segments(), p.field(), Integrator::exact, 8, g, found.spans(), set);
      const double x = 2.0 * double(kLength) * double(kOpaque);
      const bool brightness = form == SourceForm::brightness;
      // c = γ (1 − e^−x), or P ℓ (1 − e^−x)/x.
      const double by_source = brightness ? 2.0 : 2.0 * double(kLength) / x;
      const double by_extinction = brightness ? 0.0 : -2.0 * 3.0 * double(kLength) / (x * x) * 2.0 * double(kLength);
      // In front of it, thin matter takes from what the cell gives: −2 ℓ g c.
      const double in_front = -2.0 * double(kLength) * by_source * 3.0;
      CHECK(double(found.source[1]) == Approx(by_source).epsilon(2e-7));
      CHECK(double(found.extinction[1]) == Approx(by_extinction).epsilon(2e-7));
      CHECK(double(found.extinction[0]) == Approx(in_front).epsilon(2e-7));
      for (std::size_t s = 2; s < 8; ++s) {
        CHECK(found.source[s] == 0.0f);
        CHECK(found.extinction[s] == 0.0f);
      }
      check_gradients_of(Case::adjoint_behind_opaque, p);
      check_gradients_of(Case::adjoint_behind_opaque, two_extinctions_of(p));
    }
  }
}

// Behind a depth of 30 differences of whole images need more than the 19 digits of long double.
#ifdef SARNERF_QUADMATH
TEST_CASE("the reference's gradients are differences of its images", "[core]") {
  // A whole ray at once, one number changed: nothing is assumed of how segments act on one another.
  Problem<float> p;
  p.n_rows = 1;
  p.n_range = 5;
  for (const float depth : {1e-20f, 1e-3f, 0.7f, 30.0f, 1e-6f}) {
    p.add_segment(p.n_segments() < 5 ? static_cast<std::uint32_t>(p.n_segments()) : 0, 0.5f, depth, 0.7f);
  }
  p.end_ray(0);
  const std::vector<double> g = pixel_gradients(5);
  for (const Integrator integrator : kAllIntegrators) {
    for (const SourceForm form : kBothForms) {
      p.form = form;
      const ReferenceGradients expected = reference_gradients(p, integrator, g);
      for (std::size_t s = 0; s < 5; ++s) {
        const auto loss = [&](Quad change) {
          Quad before = 0, sum = 0;
          for (std::size_t n = 0; n < 5; ++n) {
            const Quad x = two_way_depth(p, n) + (n == s ? change : Quad(0));
            sum += Quad(g[n]) * Quad(p.source[n]) * quad_exp(-before) * response(integrator, form, Quad(p.length_m[n]), x);
            before += x;
          }
          return sum;
        };
        const Quad h = kDifferenceStep;
        const Quad difference = (loss(h) - loss(-h)) / (2 * h);
        INFO(name(integrator) << " segment " << s);
        CHECK(std::abs(as_double((difference - expected.by_depth[s]) / expected.size_by_depth[s])) < 1e-9);
      }
    }
  }
}
#endif
