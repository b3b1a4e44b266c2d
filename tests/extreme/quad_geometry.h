// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "quad.h"
#include "sarnerf/core/units.h"
#include "sarnerf/geometry/ray_grid.h"

/// Geometry of docs/method/conventions.md by its definition, without any care for rounding: the precision is enough.
namespace sarnerf::test {

struct QuadVector {
  Quad x = 0, y = 0, z = 0;
};
inline QuadVector operator+(const QuadVector& a, const QuadVector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline QuadVector operator-(const QuadVector& a, const QuadVector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline QuadVector operator*(Quad s, const QuadVector& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Quad dot(const QuadVector& a, const QuadVector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class Vector>
QuadVector quad_vector(const Vector& v) {
  return {Quad(v.x), Quad(v.y), Quad(v.z)};
}

struct QuadFrame {
  explicit QuadFrame(const Acquisition& a) {
    const Quad theta = a.incidence_rad, phi = a.azimuth_rad;
    const Quad st = quad_sin(theta), ct = quad_cos(theta), sp = quad_sin(phi), cp = quad_cos(phi);
    h = a.look == Look::right ? QuadVector{-cp, 0, sp} : QuadVector{cp, 0, -sp};
    v = {-ct * sp, st, -ct * cp};
    k = {-st * sp, -ct, -st * cp};
    radar = -Quad(a.slant_range_m) * k;
  }
  QuadVector h, v, k, radar;  ///< the radar's place relative to the aim point
};

/// Point relative to the aim point at along-track coordinate a and range offset s, on ray k of a fan:
/// O + a h + t d.
inline QuadVector quad_point(const Acquisition& a, const Fan& fan, const QuadFrame& frame, Quad along_m, Quad offset_m,
                             int k) {
  const Quad angle = Quad(fan.first_angle_rad) + (Quad(k) + Quad(0.5)) * Quad(fan.step_rad);
  const QuadVector d = quad_cos(angle) * frame.k + quad_sin(angle) * frame.v;
  return frame.radar + along_m * frame.h + (Quad(a.slant_range_m) + offset_m) * d;
}

/// Error of a point in units of the spacings: along track in rows, across in the finer spacing.
inline double error_in_pixels(const QuadVector& difference, const QuadFrame& frame, const Acquisition& a) {
  const double along = as_double(dot(difference, frame.h)) / a.azimuth_spacing_m;
  const double finer_m = std::min(a.azimuth_spacing_m, a.range_spacing_m);
  const double v = as_double(dot(difference, frame.v)), k = as_double(dot(difference, frame.k));
  return std::hypot(along, std::hypot(v, k) / finer_m);
}

/// Slant ranges from a crane to geostationary orbit.
inline constexpr double kRanges_m[] = {100.0, 1e3, 1e4, 7e5, 3.6e7};

/// Pitches from 0.5° to 89.5°, both ends often; any azimuth; map coordinates; spacings from 1 mm to 100 m, one
/// of four anisotropic. Images that would reach behind the radar are made smaller.
inline Acquisition extreme_acquisition(std::mt19937& random, double slant_range_m) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Acquisition a;
  const double choice = unit(random);
  a.incidence_rad = rad_from_deg(choice < 0.2 ? 0.5 : choice < 0.4 ? 89.5 : 0.5 + 89.0 * unit(random));
  a.azimuth_rad = rad_from_deg(-400.0 + 800.0 * unit(random));
  a.slant_range_m = slant_range_m;
  a.aim_m = {5e5 + unit(random), 120.0 * unit(random), -4e6 * unit(random)};
  a.look = unit(random) < 0.5 ? Look::left : Look::right;
  a.range_spacing_m = std::pow(10.0, -3.0 + 5.0 * unit(random));
  a.azimuth_spacing_m = a.range_spacing_m;
  if (unit(random) < 0.25) a.azimuth_spacing_m = std::pow(10.0, -3.0 + 5.0 * unit(random));
  const double most = 1.8 * slant_range_m / a.range_spacing_m;
  a.n_range = static_cast<int>(std::clamp(most, 1.0, 64.0));
  while (a.n_range * a.range_spacing_m >= 1.9 * slant_range_m) a.range_spacing_m *= 0.5;
  a.n_azimuth = 4096;
  return a;
}

}  // namespace sarnerf::test
