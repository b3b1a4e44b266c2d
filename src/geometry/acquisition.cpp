// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/geometry/acquisition.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "sarnerf/core/error.h"
#include "sarnerf/core/units.h"

namespace sarnerf {

double Acquisition::altitude_m() const { return slant_range_m * std::cos(incidence_rad); }

double slant_range_from_altitude_m(double altitude_m, double incidence_rad) {
  return altitude_m / std::cos(incidence_rad);
}

Acquisition widened(Acquisition acquisition, const Border& border) {
  acquisition.n_azimuth += 2 * border.azimuth;
  acquisition.n_range += 2 * border.range;
  return acquisition;
}

void validate(const Acquisition& a) {
  const auto fail = [](const std::string& what) { throw GeometryError(what); };
  const auto finite = [&](double value, const char* what) {
    if (!std::isfinite(value)) fail(std::string(what) + " must be a finite number");
  };
  finite(a.azimuth_rad, "azimuth");
  finite(a.incidence_rad, "incidence");
  finite(a.slant_range_m, "slant range");
  finite(a.azimuth_spacing_m, "azimuth spacing");
  finite(a.range_spacing_m, "range spacing");
  finite(a.azimuth_shift_m, "azimuth shift");
  finite(a.range_shift_m, "range shift");
  for (int axis = 0; axis < 3; ++axis) finite(a.aim_m[axis], "aim point");
  if (a.incidence_rad <= 0.0 || a.incidence_rad >= kPi / 2) {
    fail("incidence (pitch) must lie between 0 and 90 degrees, both excluded; it is " +
         std::to_string(deg_from_rad(a.incidence_rad)));
  }
  if (a.azimuth_spacing_m <= 0.0 || a.range_spacing_m <= 0.0) fail("pixel spacings must be positive");
  if (a.n_azimuth < 1 || a.n_range < 1) fail("an image needs at least 1 x 1 pixels");
  if (a.range_m(-0.5) <= 0.0) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "the nearest range bin lies behind the radar: slant range %.6g m, swath %.6g m; raise the "
                  "altitude or make the image smaller",
                  a.slant_range_m, a.n_range * a.range_spacing_m);
    fail(text);
  }
}

RadarFrame radar_frame(const Acquisition& a) {
  const double st = std::sin(a.incidence_rad), ct = std::cos(a.incidence_rad);
  const double sp = std::sin(a.azimuth_rad), cp = std::cos(a.azimuth_rad);
  RadarFrame frame{{-cp, 0.0, sp}, {-ct * sp, st, -ct * cp}, {-st * sp, -ct, -st * cp}};
  if (a.look == Look::left) frame.h = -frame.h;
  return frame;
}

RadarPoint project(const Acquisition& a, const RadarFrame& frame, const glm::dvec3& world_m) {
  const glm::dvec3 q = world_m - a.aim_m;
  const double along_k = glm::dot(q, frame.k);
  const double along_v = glm::dot(q, frame.v);
  const double r = a.slant_range_m;
  const double depth = r + along_k;
  const double range = std::hypot(depth, along_v);
  // |p| − r = (|p|² − r²) / (|p| + r), expanded so that r² cancels in exact arithmetic.
  const double range_offset =
      (along_k * (2.0 * r + along_k) + along_v * along_v) / (range + r);
  return {glm::dot(q, frame.h), range_offset, std::atan2(along_v, depth)};
}

std::optional<glm::ivec2> pixel_of(const Acquisition& a, const RadarPoint& p) {
  const auto i = static_cast<int>(std::lround(a.row_of(p.along_track_m)));
  const auto j = static_cast<int>(std::lround(a.bin_of(p.range_offset_m)));
  if (i < 0 || i >= a.n_azimuth || j < 0 || j >= a.n_range) return {};
  return glm::ivec2(i, j);
}

std::vector<double> plane_offsets_m(const Acquisition& a, double height_m) {
  // With g the distance along the plane, g − r sin θ is computed from g² − r² sin² θ, so that no large numbers are
  // subtracted.
  const double r = a.slant_range_m, aim = r * std::sin(a.incidence_rad);
  const double lift = height_m * (2.0 * a.altitude_m() - height_m);
  std::vector<double> offsets;
  for (int j = 0; j < a.n_range; ++j) {
    const double s = a.bin_offset_m(j);
    const double farther = s * (2.0 * r + s) + lift;  // g² − r² sin² θ
    const double g2 = aim * aim + farther;
    offsets.push_back(g2 >= 0.0 ? farther / (std::sqrt(g2) + aim) : std::numeric_limits<double>::quiet_NaN());
  }
  return offsets;
}

double height_over_plane_m(const Acquisition& a, double height_m, double delta, double range_offset_m) {
  const double theta = a.incidence_rad;
  // H − (r + s) cos(θ + δ), with the difference of the cosines of θ and θ + δ as a product.
  return -height_m + 2.0 * a.slant_range_m * std::sin(theta + 0.5 * delta) * std::sin(0.5 * delta) -
         range_offset_m * std::cos(theta + delta);
}

double plane_range_offset_m(const Acquisition& a, double height_m, double delta) {
  const double incidence = a.incidence_rad + delta, cosine = std::cos(incidence);
  if (incidence <= 0.0 || cosine <= 1e-9) return std::numeric_limits<double>::infinity();
  return height_over_plane_m(a, height_m, delta, 0.0) / cosine;
}

glm::dvec3 level_range_direction(const Acquisition& a) {
  return {-std::sin(a.azimuth_rad), 0.0, -std::cos(a.azimuth_rad)};
}

}  // namespace sarnerf
