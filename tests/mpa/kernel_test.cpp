// SPDX-License-Identifier: Apache-2.0
// The vectorised kernels against the oracle and against one another.
#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.h"
#include "random_batch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/mpa/integrate.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

std::vector<double> render(const Problem<float>& p, Integrator integrator, InstructionSet set) {
  std::vector<double> pixels(p.n_pixels(), 0.0);
  integrate(p.segments(), p.field(), integrator, p.n_range, pixels, set);
  return pixels;
}

std::vector<double> render(const Problem<double>& p, Integrator integrator) {
  std::vector<double> pixels(p.n_pixels(), 0.0);
  oracle::integrate(p.segments(), p.field(), integrator, p.n_range, pixels);
  return pixels;
}

std::vector<double> some_pixel_gradients(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> symmetric(-1.0, 1.0);
  std::vector<double> g(n);
  for (double& value : g) value = symmetric(random);
  return g;
}

template <class F>
void for_each_problem(F&& check) {
  for (Integrator integrator : kAllIntegrators) {
    for (SourceForm form : kBothForms) {
      for (bool two_extinctions : {false, true}) {
        for (double depth : {1e-2, 1.0, 1e3, 1e30}) {
          for (int longest : {3, 60, 1300}) {
            INFO(
                name(integrator) << (form == SourceForm::brightness ? " brightness" : " scattering")
                                 << ", depth " << depth << ", rays of " << longest);
            check(random_problem(7, longest > 1000 ? 4 : 60, longest, depth, two_extinctions, form),
                  integrator);
          }
        }
      }
    }
  }
}

/// Largest |a − b| over the largest |b|, a NaN counting as infinite.
template <class A, class B>
double relative_difference(const std::vector<A>& a, const std::vector<B>& b) {
  double largest = 0.0, scale = 0.0;
  for (std::size_t n = 0; n < b.size(); ++n) {
    const double difference = std::abs(static_cast<double>(a[n]) - static_cast<double>(b[n]));
    if (!(difference <= std::numeric_limits<double>::max())) return difference;
    largest = std::max(largest, difference);
    scale = std::max(scale, std::abs(static_cast<double>(b[n])));
  }
  return scale > 0.0 ? largest / scale : largest;
}

}  // namespace

TEST_CASE("contributions of segments add up to the pixels") {
  for_each_problem([](const Problem<float>& p, Integrator integrator) {
    for (InstructionSet set : available_instruction_sets()) {
      std::vector<double> c(p.segments().bin.size());
      contributions(p.segments(), p.field(), integrator, c, set);
      std::vector<double> pixels(p.n_pixels(), 0.0);
      const auto segments = p.segments();
      for (std::size_t ray = 0; ray < segments.ray_row.size(); ++ray) {
        for (std::size_t s = segments.ray_begin[ray]; s < segments.ray_begin[ray + 1]; ++s) {
          const auto n_range = static_cast<std::size_t>(p.n_range);
          if (segments.bin[s] < n_range) pixels[segments.ray_row[ray] * n_range + segments.bin[s]] += c[s];
        }
      }
      CHECK(pixels == render(p, integrator, set));
    }
  });
}

TEST_CASE("images of the kernels agree with the oracle, pixel by pixel") {
  for_each_problem([](const Problem<float>& p, Integrator integrator) {
    const std::vector<double> expected = render(p.as<double>(), integrator);
    for (InstructionSet set : available_instruction_sets()) {
      const std::vector<double> found = render(p, integrator, set);
      bool agree = true;
      for (std::size_t n = 0; n < expected.size(); ++n) {
        agree &= std::abs(found[n] - expected[n]) <= 2e-8 * expected[n] + 1e-44;
      }
      CHECK(agree);
    }
  });
}

TEST_CASE("gradients of the kernels agree with the oracle") {
  for_each_problem([](const Problem<float>& p, Integrator integrator) {
    const std::vector<double> g = some_pixel_gradients(p.n_pixels(), 3);
    const Problem<double> q = p.as<double>();
    GradientArrays<double> expected(q);
    oracle::integrate_adjoint(q.segments(), q.field(), integrator, q.n_range, g, expected.spans());
    for (InstructionSet set : available_instruction_sets()) {
      GradientArrays<float> found(p);
      integrate_adjoint(p.segments(), p.field(), integrator, p.n_range, g, found.spans(), set);
      CHECK(relative_difference(found.source, expected.source) < 2e-7);
      CHECK(relative_difference(found.extinction, expected.extinction) < 2e-7);
      CHECK(relative_difference(found.extinction_back, expected.extinction_back) < 2e-7);
    }
  });
}

TEST_CASE("all instruction sets give the same bits") {
  for_each_problem([](const Problem<float>& p, Integrator integrator) {
    const std::vector<double> g = some_pixel_gradients(p.n_pixels(), 4);
    GradientArrays<float> baseline(p);
    integrate_adjoint(p.segments(), p.field(), integrator, p.n_range, g, baseline.spans(),
                      InstructionSet::baseline);
    const std::vector<double> image = render(p, integrator, InstructionSet::baseline);
    for (InstructionSet set : available_instruction_sets()) {
      GradientArrays<float> found(p);
      integrate_adjoint(p.segments(), p.field(), integrator, p.n_range, g, found.spans(), set);
      CHECK(render(p, integrator, set) == image);
      CHECK(found.source == baseline.source);
      CHECK(found.extinction == baseline.extinction);
      CHECK(found.extinction_back == baseline.extinction_back);
    }
  });
}

TEST_CASE("nothing that float32 can hold gives NaN, infinity or a negative contribution") {
  constexpr float kHuge = 3e38f, kTiny = 1e-45f;
  const float values[] = {0.0f, kTiny, 1e-38f, 1e-20f, 1.0f, 1e20f, kHuge};
  for (InstructionSet set : available_instruction_sets()) {
    for (Integrator integrator : kAllIntegrators) {
      for (SourceForm form : kBothForms) {
        for (float length : values) {
          for (float kappa : values) {
            for (float source : values) {
              Problem<float> p;
              p.n_rows = 1;
              p.n_range = 2;
              p.form = form;
              p.add_segment(0, length, kappa, source);
              p.add_segment(1, 0.5f, 1.0f, 1.0f);
              p.end_ray(0);
              const std::vector<double> pixels = render(p, integrator, set);
              const std::vector<double> g{1.0, -1.0};
              GradientArrays<float> out(p);
              integrate_adjoint(p.segments(), p.field(), integrator, 2, g, out.spans(), set);
              INFO(name(set) << " " << name(integrator) << " l " << length << " k " << kappa
                             << " P " << source);
              CHECK((std::isfinite(pixels[0]) && pixels[0] >= 0.0 && pixels[1] >= 0.0));
              CHECK((std::isfinite(out.extinction[0]) && std::isfinite(out.source[0])));
              CHECK((std::isfinite(out.extinction[1]) && std::isfinite(out.source[1])));
            }
          }
        }
      }
    }
  }
}

TEST_CASE("P may be huge where the optical depth is: the quotient counts") {
  for (InstructionSet set : available_instruction_sets()) {
    Problem<float> p;
    p.n_rows = p.n_range = 1;
    p.add_segment(0, 100.0f, 3e38f, 3e38f);
    p.end_ray(0);
    CHECK(render(p, Integrator::exact, set)[0] == Approx(0.5).epsilon(1e-7));
  }
}

TEST_CASE("arrays that do not belong together are refused") {
  Problem<float> p = random_problem(1, 5, 9, 1.0, false, SourceForm::scattering);
  std::vector<double> pixels(p.n_pixels());
  const auto run = [&] {
    integrate(p.segments(), p.field(), Integrator::exact, p.n_range, pixels);
  };
  CHECK_NOTHROW(run());
  SECTION("source too short") {
    p.source.pop_back();
    CHECK_THROWS_AS(run(), UsageError);
  }
  SECTION("row outside the image") {
    p.ray_row[0] = 5;
    CHECK_THROWS_AS(run(), UsageError);
  }
  SECTION("rays that overlap") {
    std::swap(p.ray_begin[1], p.ray_begin[3]);
    CHECK_THROWS_AS(run(), UsageError);
  }
  SECTION("κ⁻ of another length") {
    p.extinction_back.assign(p.n_segments() + 1, 0.0f);
    CHECK_THROWS_AS(run(), UsageError);
  }
}

TEST_CASE("no rays make no image, and bins beyond it are left out") {
  Problem<float> p;
  p.n_rows = p.n_range = 2;
  std::vector<double> pixels(4, 0.0);
  integrate(p.segments(), p.field(), Integrator::exact, 2, pixels);
  p.add_segment(2, 1.0f, 1.0f, 1.0f);
  p.add_segment(kNoBin, 1.0f, 1.0f, 1.0f);
  p.end_ray(0);
  integrate(p.segments(), p.field(), Integrator::exact, 2, pixels);
  CHECK(pixels == std::vector<double>(4, 0.0));
}

TEST_CASE("integrators have names, and names integrators") {
  for (Integrator integrator : kAllIntegrators)
    CHECK(integrator_from_name(name(integrator)) == integrator);
  CHECK(name(Integrator::paper_gated) == "paper-gated");
  CHECK_THROWS_AS(integrator_from_name("exakt"), UsageError);
}
