// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/impulse_response.h"

#include <cmath>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

using namespace sarnerf;

namespace {

/// ∫ W(u) cos 2πut du by the midpoint rule: the definition, independent of the closed forms.
double transform(const Taper& taper, double t) {
  constexpr int kSteps = 20000;
  double sum = 0.0;
  for (int n = 0; n < kSteps; ++n) {
    const double u = (n + 0.5) / kSteps - 0.5;
    sum += taper.weight(u) * std::cos(2.0 * kPi * u * t);
  }
  return sum / kSteps;
}

const char* const kWindows[] = {"none", "hann", "hamming", "taylor:-35", "taylor:-25,3", "kaiser:0", "kaiser:6"};

}  // namespace

TEST_CASE("the response is the transform of the taper", "[window]") {
  for (const char* text : kWindows) {
    const Taper taper(window_from_text(text));
    INFO(text);
    for (const double t : {0.0, 0.3, 1.0, 1.7, 2.0, 3.5, 6.25, 20.1}) {
      CHECK(taper.response(t) == Approx(transform(taper, t)).margin(2e-8));
    }
  }
}

TEST_CASE("widths and sidelobes are those of the literature", "[window]") {
  // −3 dB widths in bins and highest sidelobes as in F. J. Harris, Proc. IEEE 66 (1978), table 1, or for
  // the first two by the closed forms' own digits. Taylor: the level that it is designed for.
  struct Known {
    const char* text;
    double width, sidelobe_db, margin_db;
  };
  for (const Known& known : {Known{"none", 0.8859, -13.26, 0.01}, Known{"hann", 1.4406, -31.47, 0.01},
                             Known{"hamming", 1.303, -42.7, 0.1}, Known{"kaiser:6.283185307", 1.43, -46.0, 0.5},
                             Known{"kaiser:7.853981634", 1.57, -57.0, 0.7},
                             Known{"taylor:-35", 1.184, -35.0, 0.25}, Known{"taylor:-35,6", 1.186, -35.0, 0.25}}) {
    const Taper taper(window_from_text(known.text));
    INFO(known.text);
    CHECK(taper.broadening() == Approx(known.width).epsilon(0.005));
    CHECK(taper.peak_sidelobe_db() == Approx(known.sidelobe_db).margin(known.margin_db));
    const double half = taper.response(0.5 * taper.broadening()) / taper.response(0.0);
    CHECK(half * half == Approx(0.5).epsilon(1e-9));
  }
}

TEST_CASE("a window is written as it is read", "[window]") {
  for (const char* text : {"none", "hann", "hamming", "taylor:-35,4", "taylor:-27.5,6", "kaiser:6.5"}) {
    CHECK(text_of(window_from_text(text)) == text);
  }
  CHECK(text_of(window_from_text("taylor:-35")) == "taylor:-35,4");
  for (const char* bad : {"", "rectangle", "taylor", "taylor:", "taylor:x", "taylor:35", "taylor:-10", "taylor:-200",
                          "taylor:nan", "taylor:-35,1", "taylor:-35,2.5", "taylor:-35,", "kaiser:", "kaiser:-1",
                          "kaiser:nan", "kaiser:51", "taylor:-90,2"}) {
    INFO(bad);
    CHECK_THROWS_AS(window_from_text(bad), UsageError);
  }
}

TEST_CASE("a kernel has unit energy and the autocorrelation of its band", "[impulse]") {
  for (const char* text : kWindows) {
    const Window window = window_from_text(text);
    const Taper taper(window);
    INFO(text);
    for (const double spacing_m : {0.05, 0.15, 0.2}) {
      const double resolution_m = 0.305;
      const Kernel kernel = make_kernel(window, resolution_m, spacing_m);
      CHECK(kernel.bandwidth_per_m == Approx(taper.broadening() / resolution_m));
      CHECK(kernel.neglected_energy < 1e-3);
      CHECK(kernel.energy_inside(kernel.reach(), 2 * kernel.reach() + 1) == Approx(1.0).epsilon(1e-12));
      CHECK(kernel.energy_inside(0, kernel.reach() + 1) < 1.0);
      CHECK(kernel.border <= kernel.reach());
      // White noise through the taps must be correlated as the continuous system's, although scatterers
      // lie on the pixel grid: ∫ W² cos 2πut du / ∫ W² du.
      for (const int lag : {1, 2, 3, 5, 9}) {
        double discrete = 0.0;
        for (std::size_t n = static_cast<std::size_t>(lag); n < kernel.taps.size(); ++n) {
          discrete += kernel.taps[n] * kernel.taps[n - static_cast<std::size_t>(lag)];
        }
        const double t = lag * spacing_m * kernel.bandwidth_per_m;
        double continuous = 0.0;
        constexpr int kSteps = 4000;
        for (int n = 0; n < kSteps; ++n) {
          const double u = (n + 0.5) / kSteps - 0.5;
          continuous += taper.weight(u) * taper.weight(u) * std::cos(2.0 * kPi * u * t) / kSteps;
        }
        CHECK(discrete == Approx(continuous / taper.energy()).margin(2.0 * kernel.neglected_energy + 2e-5));
      }
    }
  }
}

TEST_CASE("a point's energy does not depend on where in its pixel it lies, unless under-sampled",
          "[impulse]") {
  const Taper taper(window_from_text("hann"));
  const auto energy = [&](double step, double shift) {
    double sum = 0.0;
    for (int n = -2000; n <= 2000; ++n) sum += std::pow(taper.response(n * step + shift), 2) * step;
    return sum / taper.energy();
  };
  for (const double shift : {0.0, 0.1, 0.37}) CHECK(energy(1.0, shift) == Approx(1.0).epsilon(1e-6));
  CHECK(std::abs(energy(1.5, 0.0) - energy(1.5, 0.75)) > 0.1);

  const Window taylor = window_from_text("taylor:-35");
  const double finest = 0.305 / Taper(taylor).broadening();
  CHECK_NOTHROW(make_kernel(taylor, 0.305, finest));
  CHECK_THROWS_AS(make_kernel(taylor, 0.305, 1.001 * finest), UsageError);
  CHECK_THROWS_AS(make_kernel(taylor, 0.0, 0.1), UsageError);
  CHECK_THROWS_AS(make_kernel(taylor, std::nan(""), 0.1), UsageError);
}
