// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/field/field_sampler.h"

#include <cmath>

#include "catch.h"
#include "sarnerf/core/units.h"

using namespace sarnerf;

TEST_CASE("harmonics are orthonormal over the sphere") {
  // Midpoints in azimuth and the 3-point Gauss rule in z are exact for products of degree 4.
  const double z[3] = {-std::sqrt(0.6), 0.0, std::sqrt(0.6)};
  const double weight[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};
  constexpr int kAzimuths = 8;
  double product[kMaxHarmonics][kMaxHarmonics] = {};
  for (int n = 0; n < 3; ++n) {
    for (int m = 0; m < kAzimuths; ++m) {
      const double phi = 2.0 * kPi * (m + 0.5) / kAzimuths;
      const double s = std::sqrt(1.0 - z[n] * z[n]);
      const auto y = spherical_harmonics(glm::dvec3(s * std::cos(phi), s * std::sin(phi), z[n]), 2);
      for (std::size_t a = 0; a < kMaxHarmonics; ++a) {
        for (std::size_t b = 0; b < kMaxHarmonics; ++b) {
          product[a][b] += weight[n] * (2.0 * kPi / kAzimuths) * y[a] * y[b];
        }
      }
    }
  }
  for (int a = 0; a < kMaxHarmonics; ++a) {
    for (int b = 0; b < kMaxHarmonics; ++b) {
      CHECK(product[a][b] == within_margin(a == b ? 1.0 : 0.0, 1e-14));
    }
  }
}

TEST_CASE("harmonics come in the stated order, with the stated signs") {
  const auto along = [](double x, double y, double z) {
    return spherical_harmonics(glm::dvec3(x, y, z), 2);
  };
  CHECK(along(0, 1, 0)[1] == Approx(std::sqrt(3 / (4 * kPi))));
  CHECK(along(0, 0, 1)[2] == Approx(std::sqrt(3 / (4 * kPi))));
  CHECK(along(1, 0, 0)[3] == Approx(std::sqrt(3 / (4 * kPi))));
  const double h = std::sqrt(0.5);
  CHECK(along(h, h, 0)[4] == Approx(std::sqrt(15 / (4 * kPi)) / 2));
  CHECK(along(0, h, h)[5] == Approx(std::sqrt(15 / (4 * kPi)) / 2));
  CHECK(along(0, 0, 1)[6] == Approx(std::sqrt(5 / (4 * kPi))));
  CHECK(along(h, 0, h)[7] == Approx(std::sqrt(15 / (4 * kPi)) / 2));
  CHECK(along(1, 0, 0)[8] == Approx(std::sqrt(15 / (16 * kPi))));
  CHECK(along(0, 1, 0)[8] == Approx(-std::sqrt(15 / (16 * kPi))));
}

TEST_CASE("harmonics beyond the degree are 0") {
  for (int degree = 0; degree <= 2; ++degree) {
    const auto y = spherical_harmonics(glm::vec3(0.48f, 0.6f, 0.64f), degree);
    for (int n = 0; n < kMaxHarmonics; ++n) {
      CHECK((y[static_cast<std::size_t>(n)] == 0.0f) == (n >= n_harmonics(degree)));
    }
  }
}
