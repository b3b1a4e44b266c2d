// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <random>

#include "sarnerf/core/units.h"
#include "sarnerf/geometry/acquisition.h"

namespace sarnerf::test {

/// Altitudes from a crane to geostationary orbit.
inline constexpr double kAllAltitudes_m[] = {100.0, 1e3, 1e4, 7e5, 3.6e7};

inline Acquisition acquisition(double incidence_deg, double azimuth_deg, double altitude_m) {
  Acquisition a;
  a.incidence_rad = rad_from_deg(incidence_deg);
  a.azimuth_rad = rad_from_deg(azimuth_deg);
  a.slant_range_m = slant_range_from_altitude_m(altitude_m, a.incidence_rad);
  a.n_azimuth = 64;
  a.n_range = 96;
  a.azimuth_spacing_m = 0.4;
  a.range_spacing_m = 0.3;
  return a;
}

inline Acquisition view_of(double pitch_deg, double altitude_m = 10000.0, int n_azimuth = 128,
                           int n_range = 128, double spacing_m = 0.3, double azimuth_deg = 0.0) {
  Acquisition a;
  a.azimuth_rad = rad_from_deg(azimuth_deg);
  a.incidence_rad = rad_from_deg(pitch_deg);
  a.slant_range_m = slant_range_from_altitude_m(altitude_m, a.incidence_rad);
  a.n_azimuth = n_azimuth;
  a.n_range = n_range;
  a.azimuth_spacing_m = a.range_spacing_m = spacing_m;
  return a;
}

/// Random angles; an aim point in map coordinates.
inline Acquisition random_acquisition(std::mt19937& random, double altitude_m) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Acquisition a = acquisition(5.0 + 80.0 * unit(random), -400.0 + 800.0 * unit(random), altitude_m);
  a.aim_m = {5e5 + unit(random), 120.0 * unit(random), -4e6 * unit(random)};
  a.look = unit(random) < 0.5 ? Look::left : Look::right;
  return a;
}

using Wide = glm::vec<3, long double>;

/// The radar frame by its definition, in long double: at geostationary range its rounding is 3e-12 m.
struct WideFrame {
  explicit WideFrame(const Acquisition& a) {
    const long double theta = a.incidence_rad, phi = a.azimuth_rad;
    const long double st = std::sin(theta), ct = std::cos(theta), sp = std::sin(phi),
                      cp = std::cos(phi);
    h = a.look == Look::right ? Wide(-cp, 0, sp) : Wide(cp, 0, -sp);
    v = Wide(-ct * sp, st, -ct * cp);
    k = Wide(-st * sp, -ct, -st * cp);
    radar = -static_cast<long double>(a.slant_range_m) * k;  // relative to the aim point
  }
  Wide h, v, k, radar;
};

inline double error_m(const glm::dvec3& found, const Wide& expected) {
  return static_cast<double>(glm::length(Wide(found) - expected));
}

}  // namespace sarnerf::test
