// SPDX-License-Identifier: Apache-2.0
// A homogeneous slab cut into equal segments, against each integrator's own geometric series.
#include <algorithm>
#include <cmath>

#include "catch.h"
#include "random_batch.h"
#include "sarnerf/mpa/integrate.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kLength = 12.8;  // m
constexpr double kSource = 0.7;

/// Source times Σ_{s<n} e^{−s x} f(x) = f(x) (1 − e^{−n x})/(1 − e^{−x}), with x = depth/n and f the
/// contribution of one segment.
double closed_form(Integrator integrator, SourceForm form, double depth, int n) {
  const double x = depth / n;
  double f = 0.0;  // x w(x)
  switch (integrator) {
    case Integrator::exact:
      f = -std::expm1(-x);
      break;
    case Integrator::midpoint:
      f = x * std::exp(-x / 2);
      break;
    case Integrator::paper:
      f = x * std::exp(-x);
      break;
    case Integrator::paper_gated:
      f = std::tanh(x) * std::exp(-x);
      break;
  }
  const double gamma = form == SourceForm::brightness ? kSource : kSource * kLength / depth;
  return gamma * f * (std::expm1(-depth) / std::expm1(-x));
}

Problem<double> slab(SourceForm form, double depth, int n) {
  Problem<double> p;
  p.n_rows = 1;
  p.n_range = 1;
  p.form = form;
  for (int s = 0; s < n; ++s) p.add_segment(0, kLength / n, 0.5 * depth / kLength, kSource);
  p.end_ray(0);
  return p;
}

/// Contributions that float32 cannot tell from nothing.
double floor_of(SourceForm form) {
  return form == SourceForm::brightness ? 1e-44 : 1e-44 * kLength;
}

}  // namespace

TEST_CASE("a slab has its closed form in double, whatever its depth") {
  for (Integrator integrator : kAllIntegrators) {
    for (SourceForm form : kBothForms) {
      for (int n : {1, 2, 17, 64}) {
        for (int decade = -6; decade <= 6; ++decade) {
          const double depth = std::pow(10.0, decade);
          const Problem<double> p = slab(form, depth, n);
          double pixel = 0.0;
          oracle::integrate(p.segments(), p.field(), integrator, 1, {&pixel, 1});
          const double expected = closed_form(integrator, form, depth, n);
          INFO(name(integrator) << " depth " << depth << " in " << n);
          CHECK(std::abs(pixel - expected) <=
                1e-12 * expected * (1 + 0.01 * std::min(depth, 745.0)));
        }
      }
    }
  }
}

TEST_CASE("a slab has its closed form in float, on every instruction set") {
  for (InstructionSet set : available_instruction_sets()) {
    for (Integrator integrator : kAllIntegrators) {
      for (SourceForm form : kBothForms) {
        for (int n : {1, 2, 17, 64, 1500}) {
          for (int decade = -6; decade <= 6; ++decade) {
            const double depth = std::pow(10.0, decade);
            const Problem<float> p = slab(form, depth, n).as<float>();
            double pixel = 0.0;
            integrate(p.segments(), p.field(), integrator, 1, {&pixel, 1}, set);
            const double expected = closed_form(integrator, form, depth, n);
            INFO(name(set) << " " << name(integrator) << " depth " << depth << " in " << n);
            CHECK(std::abs(pixel - expected) <= 1e-6 * (1 + depth) * expected + floor_of(form));
          }
        }
      }
    }
  }
}

TEST_CASE("an opaque surface gives its brightness, at any resolution") {
  for (InstructionSet set : available_instruction_sets()) {
    for (double kappa : {1e3, 1e10, 1e38}) {
      Problem<float> p;
      p.n_rows = p.n_range = 1;
      p.form = SourceForm::brightness;
      for (int s = 0; s < 3; ++s) p.add_segment(0, 0.3f, static_cast<float>(kappa), 0.25f);
      p.end_ray(0);
      double pixel = 0.0;
      integrate(p.segments(), p.field(), Integrator::exact, 1, {&pixel, 1}, set);
      CHECK(pixel == 0.25);
    }
  }
}
