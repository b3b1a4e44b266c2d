// SPDX-License-Identifier: Apache-2.0
// Contributions and pixels where depths, lengths and sources are extreme: kernels and oracle against quadruple
// precision.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "catch.h"
#include "matrix.h"
#include "mpa_reference.h"
#include "sarnerf/mpa/integrate.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

constexpr double kSmallestNormal = std::numeric_limits<float>::min();

/// Error of a pixel relative to its value; below the smallest normal float relative to that.
double pixel_error(double found, Quad expected) {
  const Quad scale = expected > Quad(kSmallestNormal) ? expected : Quad(kSmallestNormal);
  return as_double((Quad(found) - expected) / scale);
}

/// Renders with every integrator, form, instruction set and with the oracle. What integrate() promises is
/// tighter than the 1e-6 (1 + depth) that is asked of it.
void check_pixels(Case row, Problem<float> p) {
  bool right = true, no_negative = true, oracle_right = true;
  for (const Integrator integrator : kAllIntegrators) {
    for (const SourceForm form : kBothForms) {
      p.form = form;
      const std::vector<Quad> expected = reference_pixels(p, integrator);
      const auto compare = [&](const std::vector<double>& found, Case into, double tolerance) {
        bool all = true;
        for (std::size_t n = 0; n < found.size(); ++n) {
          no_negative &= found[n] >= 0.0 && std::isfinite(found[n]);
          const double error = pixel_error(found[n], expected[n]);
          record(into, error);
          all &= std::abs(error) <= tolerance;
        }
        return all;
      };
      for (const InstructionSet set : available_instruction_sets()) {
        std::vector<double> found(p.n_pixels(), 0.0);
        integrate(p.segments(), p.field(), integrator, p.n_range, found, set);
        right &= compare(found, row, 2e-8);
      }
      const Problem<double> q = p.as<double>();
      std::vector<double> found(p.n_pixels(), 0.0);
      oracle::integrate(q.segments(), q.field(), integrator, q.n_range, found);
      oracle_right &= compare(found, Case::oracle, 1e-12);
    }
  }
  CHECK(right);
  CHECK(oracle_right);
  CHECK(no_negative);
}

/// Powers of ten between two exponents.
class Decades {
 public:
  Decades(unsigned seed) : random_(seed) {}
  float operator()(double first, double last) {
    const double value = std::pow(10.0, first + (last - first) * unit_(random_));
    return static_cast<float>(std::min(value, kLargestFloat));
  }
  bool chance(double probability) { return unit_(random_) < probability; }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> unit_{0.0, 1.0};
};

void with_both_extinctions(Case row, Problem<float> p, Decades& decades) {
  check_pixels(row, p);
  for (const float forth : p.extinction) {
    p.extinction_back.push_back(decades.chance(0.2) ? 0.0f : static_cast<float>(double(forth) * 0.01));
  }
  std::reverse(p.extinction_back.begin(), p.extinction_back.end());
  check_pixels(row, p);
}

Problem<float> empty_problem(int n_rows, int n_range) {
  Problem<float> p;
  p.n_rows = n_rows;
  p.n_range = n_range;
  return p;
}

}  // namespace

TEST_CASE("depths from 1e-30 to 1e30 mixed in one ray", "[core]") {
  Decades decades(1);
  Problem<float> p = empty_problem(200, 24);
  for (std::uint32_t ray = 0; ray < 200; ++ray) {
    // Some rays stay thin, or all but their first segment would lie behind opaque matter.
    const double most = decades.chance(0.3) ? 30.0 : decades.chance(0.5) ? 0.0 : 2.0;
    for (std::uint32_t j = 0; j < 24; ++j) {
      const float length = decades(-2.0, 2.0);
      const double kappa = double(decades(-30.0, most)) / double(length) / 2.0;
      p.add_segment(j, length, static_cast<float>(kappa), decades(-6.0, 6.0));
    }
    p.end_ray(ray);
  }
  with_both_extinctions(Case::mixed_depths, p, decades);
}

TEST_CASE("every depth of a single segment, across the seams of the kernels' functions", "[core]") {
  Decades decades(2);
  Problem<float> p = empty_problem(1, 2000);
  for (std::uint32_t j = 0; j < 2000; ++j) {
    const double near_a_seam[] = {0.5, 1.0, 104.0, 266.0, 0.01};
    const double depth = j % 2 == 0 ? double(decades(-30.0, 30.0))
                                    : near_a_seam[j / 2 % 5] * (1.0 + 1e-6 * (double(j % 20) - 10.0));
    p.add_segment(j, 1.0f, static_cast<float>(0.5 * depth), 1.0f);
    p.end_ray(0);
  }
  check_pixels(Case::mixed_depths, p);
}

TEST_CASE("extinction without scattering is black, scattering without extinction is P times length", "[core]") {
  Decades decades(3);
  Problem<float> black = empty_problem(1, 40), clear = black;
  Quad expected = 0;
  for (std::uint32_t j = 0; j < 40; ++j) {
    const float length = decades(-3.0, 3.0), value = decades(-30.0, 30.0);
    black.add_segment(j, length, value, 0.0f);
    clear.add_segment(j, length, 0.0f, value);
    expected += Quad(length) * Quad(value);
  }
  black.end_ray(0);
  clear.end_ray(0);
  for (const Integrator integrator : kAllIntegrators) {
    for (const InstructionSet set : available_instruction_sets()) {
      for (const SourceForm form : kBothForms) {
        black.form = clear.form = form;
        std::vector<double> dark(40, 0.0), bright(40, 0.0);
        integrate(black.segments(), black.field(), integrator, 40, dark, set);
        integrate(clear.segments(), clear.field(), integrator, 40, bright, set);
        CHECK(dark == std::vector<double>(40, 0.0));
        if (form == SourceForm::brightness) {
          // γ without extinction is no matter.
          CHECK(bright == std::vector<double>(40, 0.0));
          continue;
        }
        Quad sum = 0;
        for (const double pixel : bright) sum += Quad(pixel);
        CHECK(std::abs(pixel_error(as_double(sum), expected)) < 1e-15);
      }
    }
  }
  check_pixels(Case::one_without_the_other, black);
  check_pixels(Case::one_without_the_other, clear);
}

TEST_CASE("neighbours that differ by 1e12", "[core]") {
  Decades decades(4);
  Problem<float> p = empty_problem(60, 32);
  for (std::uint32_t ray = 0; ray < 60; ++ray) {
    const float thin = decades(-16.0, -8.0);
    for (std::uint32_t j = 0; j < 32; ++j) {
      const bool high = (j + ray) % 2 == 0, bright = decades.chance(0.5);
      // One dense segment in each ray, or thin ones with a jump in scattering.
      const float kappa = static_cast<float>(double(thin) * (high && ray % 3 == 0 ? 1e12 : 1.0));
      p.add_segment(j, 0.3f, kappa, bright ? 1e6f : 1e-6f);
    }
    p.end_ray(ray);
  }
  with_both_extinctions(Case::jumps, p, decades);
}

TEST_CASE("rays of 10,000 bins", "[core]") {
  Decades decades(5);
  Problem<float> p = empty_problem(6, 10000);
  for (std::uint32_t ray = 0; ray < 6; ++ray) {
    // In all 1e-4 to 100 deep, in even or in very uneven portions.
    const double total = std::pow(10.0, -4.0 + 1.2 * ray);
    for (std::uint32_t j = 0; j < 10000; ++j) {
      const double portion = ray % 2 == 0 ? 1.0 : 10.0 * double(decades(-6.0, 0.0));
      p.add_segment(j, 0.3f, static_cast<float>(total * portion / 10000.0 / 0.6), decades(-1.0, 1.0));
    }
    p.end_ray(ray);
  }
  check_pixels(Case::long_rays, p);
  // All in one bin: the sum of 10,000 contributions.
  std::fill(p.bin.begin(), p.bin.end(), 0u);
  check_pixels(Case::long_rays, p);
}

TEST_CASE("denormal lengths, extinctions and sources", "[core]") {
  const float values[] = {0.0f, 1.4e-45f, 3e-42f, 1e-38f, 1e-20f, 1.0f, 1e20f};
  Problem<float> p = empty_problem(1, 3);
  p.n_rows = 0;
  for (const float length : values) {
    for (const float kappa : values) {
      for (const float source : values) {
        p.add_segment(0, length, kappa, source);
        p.add_segment(1, source, length, kappa);
        p.add_segment(2, 1.0f, 0.1f, 1.0f);
        p.end_ray(static_cast<std::uint32_t>(p.n_rows++));
      }
    }
  }
  check_pixels(Case::denormals, p);
}

TEST_CASE("products beyond float32", "[core]") {
  const float values[] = {1.0f, 1e10f, 1e25f, 3.4e38f};
  Problem<float> p = empty_problem(0, 4);
  for (const float length : {1e-3f, 1.0f, 1e3f, 3.4e38f}) {
    for (const float kappa : {0.0f, 1e-38f, 1e-3f, 1.0f, 1e10f, 3.4e38f}) {
      for (const float source : values) {
        // What a segment as bright as float32 allows gives behind matter far deeper than transmittances in
        // float32 reach is a normal number still.
        p.add_segment(0, 0.5f, 55.0f, 1.0f);
        p.add_segment(1, length, kappa, source);
        p.add_segment(2, 1.0f, 50.0f, source);
        p.add_segment(3, 1.0f, 0.1f, source);
        p.end_ray(static_cast<std::uint32_t>(p.n_rows++));
        p.add_segment(1, length, kappa, source);
        p.add_segment(2, 1.0f, 1.0f, source);
        p.end_ray(static_cast<std::uint32_t>(p.n_rows++));
      }
    }
  }
  check_pixels(Case::overflow, p);
}
