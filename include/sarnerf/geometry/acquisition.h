// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/core/impulse_response.h"

namespace sarnerf {

/// Axis-aligned box in world coordinates (m). Default-constructed it is empty.
struct Box {
  glm::dvec3 min{std::numeric_limits<double>::infinity()};
  glm::dvec3 max{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  glm::dvec3 centre() const { return 0.5 * (min + max); }
  glm::dvec3 size() const { return max - min; }

  void include(const glm::dvec3& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }

  std::array<glm::dvec3, 8> corners() const {
    std::array<glm::dvec3, 8> c;
    for (int n = 0; n < 8; ++n) {
      c[static_cast<std::size_t>(n)] = {n & 1 ? max.x : min.x, n & 2 ? max.y : min.y,
                                        n & 4 ? max.z : min.z};
    }
    return c;
  }
};

enum class Look { right, left };

/// One SAR view: the radar's position and the pixels of its image.
///
/// World frame: right-handed, metres, Y up. At azimuth 0 the radar stands over +Z of the aim point;
/// azimuth grows towards +X, counter-clockwise seen from above. Rows i run along track, columns j
/// along slant range, both centred on the aim point (docs/method/conventions.md has a drawing).
struct Acquisition {
  double azimuth_rad = 0.0;
  double incidence_rad = std::numbers::pi / 4;  ///< at the aim point, from the vertical; the paper's pitch
  double slant_range_m = 0.0;                   ///< radar to aim point
  glm::dvec3 aim_m{0.0};
  Look look = Look::right;
  int n_azimuth = 0;
  int n_range = 0;
  double azimuth_spacing_m = 0.0;
  double range_spacing_m = 0.0;
  /// Registration: offset of the image's centre from the aim point, along track and in slant range. 0 where poses are exact.
  /// The offsets below include it. (The engines of `render` make images without shifts.)
  double azimuth_shift_m = 0.0, range_shift_m = 0.0;

  /// Height of the radar above the aim point (m).
  double altitude_m() const;

  /// Along-track coordinate of the centre of row i relative to the aim point (m).
  double row_offset_m(double i) const { return (i - 0.5 * (n_azimuth - 1)) * azimuth_spacing_m + azimuth_shift_m; }

  /// Fractional row at an along-track coordinate (m): the inverse of row_offset_m().
  double row_of(double along_m) const { return (along_m - azimuth_shift_m) / azimuth_spacing_m + 0.5 * (n_azimuth - 1); }

  /// Slant range of the centre of bin j minus that of the aim point (m). Kernels use this difference and not
  /// the range itself: it is exact in float32 for a radar at any distance.
  double bin_offset_m(double j) const { return (j - 0.5 * (n_range - 1)) * range_spacing_m + range_shift_m; }

  /// Fractional bin at a range offset (m): the inverse of bin_offset_m().
  double bin_of(double offset_m) const { return (offset_m - range_shift_m) / range_spacing_m + 0.5 * (n_range - 1); }

  /// Slant range of the centre of bin j (m).
  double range_m(double j) const { return slant_range_m + bin_offset_m(j); }
};

/// Slant range of the aim point for a radar `altitude_m` above it.
double slant_range_from_altitude_m(double altitude_m, double incidence_rad);

/// Throws GeometryError unless the acquisition is finite and possible: incidence inside (0°, 90°), positive
/// spacings, at least one pixel, and every bin in front of the radar. Shifts are not checked for being finite.
void validate(const Acquisition& acquisition);

/// The same view with a border on every side. Both have the same centre, so their common pixels coincide.
Acquisition widened(Acquisition acquisition, const Border& border);

/// Unit vectors of the radar in world coordinates; columns of printed eq. 19.
struct RadarFrame {
  glm::dvec3 h;  ///< along track, direction of growing i
  glm::dvec3 v;  ///< off nadir: turning a ray towards +v increases its incidence
  glm::dvec3 k;  ///< slant range, from the radar to the aim point
};

/// h × v = k when looking right; looking left mirrors h.
RadarFrame radar_frame(const Acquisition& acquisition);

/// A world point seen from the radar.
struct RadarPoint {
  double along_track_m;    ///< along h, relative to the aim point
  double range_offset_m;   ///< distance in the row's plane minus the slant range of the aim point
  double ray_angle_rad;    ///< δ, from k towards +v
};

/// Projects a world point to (along-track coordinate, range offset, ray angle). Exact for scenes far from the
/// origin because it only uses differences to the aim point, and for radars far away because the range
/// difference is computed without subtracting large numbers.
RadarPoint project(const Acquisition& acquisition, const RadarFrame& frame, const glm::dvec3& world_m);

/// Row and bin of the pixel that holds a point; empty where the point lies outside the image.
std::optional<glm::ivec2> pixel_of(const Acquisition& acquisition, const RadarPoint& point);

/// Horizontal distances d_j (m), from the aim point away from the radar, at which the centres of the bins see the level
/// plane `height_m` above the aim point, [n_range]; NaN in bins that are nearer than the plane. In pixel (i, j) the radar
/// sees this point of the plane, relative to the aim point:
///
///     height ŷ + a_i h + d_j u        u = (−sin φ, 0, −cos φ)
std::vector<double> plane_offsets_m(const Acquisition& acquisition, double height_m);

/// Height (m) of the point at ray angle δ and range offset s = t − r over the level plane `height_m` above the aim
/// point: H − t cos(θ + δ), where H is the height of the radar over the plane. No large numbers are subtracted.
double height_over_plane_m(const Acquisition& acquisition, double height_m, double ray_angle_rad, double range_offset_m);

/// Range offset t − r (m) at which the ray of angle δ meets the level plane `height_m` above the aim point:
/// (H − r cos(θ + δ)) / cos(θ + δ). Infinite for rays at or beyond the horizon, and for rays at or behind the nadir.
double plane_range_offset_m(const Acquisition& acquisition, double height_m, double ray_angle_rad);

/// u: the horizontal direction of growing range.
glm::dvec3 level_range_direction(const Acquisition& acquisition);

}  // namespace sarnerf
