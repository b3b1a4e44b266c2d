// SPDX-License-Identifier: Apache-2.0
// What must hold for any field, whatever the numbers.
#include <cmath>
#include <numeric>

#include "catch.h"
#include "random_batch.h"
#include "sarnerf/mpa/integrate.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::vector<double> image(const Problem<double>& p, Integrator integrator) {
  std::vector<double> pixels(p.n_pixels(), 0.0);
  oracle::integrate(p.segments(), p.field(), integrator, p.n_range, pixels);
  return pixels;
}

std::vector<double> image(const Problem<float>& p, Integrator integrator) {
  std::vector<double> pixels(p.n_pixels(), 0.0);
  integrate(p.segments(), p.field(), integrator, p.n_range, pixels);
  return pixels;
}

double total(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

void check_close(const std::vector<double>& a, const std::vector<double>& b, double tolerance) {
  REQUIRE(a.size() == b.size());
  for (std::size_t n = 0; n < a.size(); ++n) {
    CHECK(std::abs(a[n] - b[n]) <= tolerance * (1e-30 + std::abs(b[n])));
  }
}

}  // namespace

TEST_CASE("images are linear in the source") {
  for (Integrator integrator : kAllIntegrators) {
    Problem<float> p = random_problem(5, 50, 50, 2.0, true, SourceForm::scattering);
    const std::vector<double> once = image(p, integrator);
    for (float& value : p.source) value *= 4.0f;
    std::vector<double> expected = once;
    for (double& value : expected) value *= 4.0;
    CHECK(image(p, integrator) == expected);  // a power of two: bitwise
  }
}

TEST_CASE("the order of rays does not matter") {
  for (Integrator integrator : kAllIntegrators) {
    const Problem<float> p = random_problem(6, 80, 30, 2.0, false, SourceForm::brightness);
    Problem<float> reversed;
    reversed.n_rows = p.n_rows;
    reversed.n_range = p.n_range;
    reversed.form = p.form;
    for (std::size_t q = p.ray_row.size(); q-- > 0;) {
      for (std::size_t s = p.ray_begin[q]; s < p.ray_begin[q + 1]; ++s) {
        reversed.add_segment(p.bin[s], p.length_m[s], p.extinction[s], p.source[s]);
      }
      reversed.end_ray(p.ray_row[q]);
    }
    check_close(image(reversed, integrator), image(p, integrator), 1e-13);
  }
}

TEST_CASE("a ray alone in a call and among others is the same ray, bit for bit") {
  const Problem<float> p = random_problem(8, 40, 300, 2.0, false, SourceForm::brightness);
  std::vector<double> together(p.n_pixels(), 0.0), apart(p.n_pixels(), 0.0);
  integrate(p.segments(), p.field(), Integrator::exact, p.n_range, together);
  for (std::size_t q = 0; q < p.ray_row.size(); ++q) {
    Problem<float> one;
    one.n_rows = p.n_rows;
    one.n_range = p.n_range;
    one.form = p.form;
    for (std::size_t s = p.ray_begin[q]; s < p.ray_begin[q + 1]; ++s) {
      one.add_segment(p.bin[s], p.length_m[s], p.extinction[s], p.source[s]);
    }
    one.end_ray(p.ray_row[q]);
    integrate(one.segments(), one.field(), Integrator::exact, one.n_range, apart);
  }
  CHECK(apart == together);
}

TEST_CASE("a part of the rays is worked on beside the arrays of all") {
  const Problem<float> p = random_problem(13, 60, 50, 2.0, true, SourceForm::scattering);
  const std::vector<double> g(p.n_pixels(), 0.5);
  std::vector<double> pixels(p.n_pixels(), 0.0);
  GradientArrays<float> whole(p), parts(p);
  integrate_adjoint(p.segments(), p.field(), Integrator::exact, p.n_range, g, whole.spans());
  for (std::size_t first = 0; first < 60; first += 20) {
    SegmentSpans<float> part = p.segments();
    part.ray_begin = part.ray_begin.subspan(first, 21);
    part.ray_row = part.ray_row.subspan(first, 20);
    integrate(part, p.field(), Integrator::exact, p.n_range, pixels);
    integrate_adjoint(part, p.field(), Integrator::exact, p.n_range, g, parts.spans());
  }
  CHECK(pixels == image(p, Integrator::exact));
  CHECK(parts.source == whole.source);
  CHECK(parts.extinction == whole.extinction);
  CHECK(parts.extinction_back == whole.extinction_back);
}

TEST_CASE("cutting segments in two changes nothing under `exact`") {
  for (SourceForm form : kBothForms) {
    const Problem<double> whole = random_problem(9, 50, 40, 5.0, false, form).as<double>();
    Problem<double> halves;
    halves.n_rows = whole.n_rows;
    halves.n_range = whole.n_range;
    halves.form = form;
    for (std::size_t q = 0; q < whole.ray_row.size(); ++q) {
      for (std::size_t s = whole.ray_begin[q]; s < whole.ray_begin[q + 1]; ++s) {
        for (double part : {0.3, 0.7}) {
          halves.add_segment(whole.bin[s], part * whole.length_m[s], whole.extinction[s],
                             whole.source[s]);
        }
      }
      halves.end_ray(whole.ray_row[q]);
    }
    check_close(image(halves, Integrator::exact), image(whole, Integrator::exact), 1e-12);
    check_close(image(halves.as<float>(), Integrator::exact), image(whole, Integrator::exact),
                1e-6);
  }
}

TEST_CASE("every integrator tends to `exact` as segments get shorter") {
  for (SourceForm form : kBothForms) {
    for (Integrator integrator : kAllIntegrators) {
      double error[2];
      for (int level = 0; level < 2; ++level) {
        const int n = level == 0 ? 1000 : 2000;
        Problem<double> p;
        p.n_rows = p.n_range = 1;
        p.form = form;
        for (int s = 0; s < n; ++s) p.add_segment(0, 3.0 / n, 0.5, 0.4);
        p.end_ray(0);
        const double exact = image(p, Integrator::exact)[0];
        error[level] = std::abs(image(p, integrator)[0] / exact - 1.0);
      }
      CHECK(error[1] < 2e-3);
      // First order: half the error; second order: a quarter.
      if (integrator == Integrator::midpoint) CHECK(error[1] < 0.26 * error[0]);
      if (integrator == Integrator::paper) CHECK(error[1] == Approx(0.5 * error[0]).epsilon(0.01));
    }
  }
}

TEST_CASE("the matrix form with the inclusive triangle is `paper`") {
  // Printed eqs. 9 to 12 for one elevation ray per row: I = S ∘ exp(σ TRI), σ = −x, TRI ones on and
  // above the diagonal.
  constexpr std::size_t kRows = 3, kBins = 20;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Problem<double> p;
  p.n_rows = kRows;
  p.n_range = kBins;
  for (std::uint32_t i = 0; i < kRows; ++i) {
    for (std::uint32_t j = 0; j < kBins; ++j) p.add_segment(j, 0.3, unit(random), unit(random));
    p.end_ray(i);
  }
  std::vector<double> matrix(kRows * kBins);
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t j = 0; j < kBins; ++j) {
      double sigma_tri = 0.0;
      for (std::size_t m = 0; m < kBins; ++m) {
        const double tri = m <= j ? 1.0 : 0.0;
        sigma_tri += -2.0 * 0.3 * p.extinction[i * kBins + m] * tri;
      }
      matrix[i * kBins + j] = 0.3 * p.source[i * kBins + j] * std::exp(sigma_tri);
    }
  }
  check_close(image(p, Integrator::paper), matrix, 1e-12);
  check_close(image(p.as<float>(), Integrator::paper), matrix, 1e-6);
}

TEST_CASE("a ray never returns more than the brightest matter on it") {
  for (Integrator integrator : kAllIntegrators) {
    for (double depth : {1e-3, 1.0, 1e3, 1e30}) {
      Problem<float> p = random_problem(10, 1, 400, depth, true, SourceForm::brightness);
      while (p.n_segments() < 50)
        p.add_segment(0, 0.1f, 1.0f, 1.0f), p.extinction_back.push_back(1.0f);
      p.ray_begin.back() = static_cast<std::uint32_t>(p.n_segments());
      for (float& gamma : p.source) gamma = 1.0f;
      CHECK(total(image(p, integrator)) <= 1.0 + 1e-8);
    }
  }
}

TEST_CASE(
    "an empty second extinction means κ⁻ = κ⁺, bit for bit, and its gradient is the sum of both") {
  for (Integrator integrator : kAllIntegrators) {
    for (SourceForm form : kBothForms) {
      const Problem<float> one = random_problem(12, 50, 40, 5.0, false, form);
      Problem<float> two = one;
      two.extinction_back = two.extinction;
      CHECK(image(one, integrator) == image(two, integrator));

      const std::vector<double> g(one.n_pixels(), 1.0);
      GradientArrays<float> of_one(one), of_two(two);
      integrate_adjoint(one.segments(), one.field(), integrator, one.n_range, g, of_one.spans());
      integrate_adjoint(two.segments(), two.field(), integrator, two.n_range, g, of_two.spans());
      bool sum = true;
      for (std::size_t s = 0; s < one.n_segments(); ++s) {
        sum &= of_one.extinction[s] == of_two.extinction[s] + of_two.extinction_back[s];
      }
      CHECK(sum);
    }
  }
}
