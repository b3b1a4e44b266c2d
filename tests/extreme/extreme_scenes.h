// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "../render/voxel_scenes.h"
#include "quad.h"

/// Planes whose image is known bin by bin: β⁰_j = γ r_j Δθ_j / Δr, with Δθ_j the angle under which the radar
/// sees the part of the plane inside bin j. Nothing is approximated, at any range or angle.
namespace sarnerf::test {

/// The view of a scene at the aim point, some bins deep.
inline Acquisition extreme_view(double slant_range_m, double pitch_deg, double spacing_m, int n_azimuth, int n_range) {
  Acquisition a;
  a.incidence_rad = rad_from_deg(pitch_deg);
  a.slant_range_m = slant_range_m;
  a.n_azimuth = n_azimuth;
  a.n_range = n_range;
  a.azimuth_spacing_m = a.range_spacing_m = spacing_m;
  return a;
}

/// A plane across the view: all of it lies at one height, or at one ground distance.
class KnownPlane {
 public:
  /// Horizontal, `height_m` above the aim point, between two ground distances from it (m, growing away from
  /// the radar).
  static KnownPlane level(const Acquisition& a, double height_m, double first_m, double last_m) {
    KnownPlane p(a, true, Quad(a.slant_range_m) * quad_cos(Quad(a.incidence_rad)) - Quad(height_m));
    const Quad distance = Quad(a.slant_range_m) * quad_sin(Quad(a.incidence_rad));
    p.set_ends(distance + Quad(first_m), distance + Quad(last_m));
    return p;
  }
  /// Vertical and facing the radar, at the aim point's ground distance, between two heights above it (m).
  static KnownPlane wall(const Acquisition& a, double first_m, double last_m) {
    KnownPlane p(a, false, Quad(a.slant_range_m) * quad_sin(Quad(a.incidence_rad)));
    const Quad height = Quad(a.slant_range_m) * quad_cos(Quad(a.incidence_rad));
    p.set_ends(height - Quad(first_m), height - Quad(last_m));
    return p;
  }

  /// β⁰ of bin j for γ = 1.
  double beta0(int j) const {
    const Quad range = bin_border(Quad(j) + Quad(0.5)) + Quad(a_.slant_range_m);
    const Quad seen = angle(clamped(bin_border(Quad(j) + 1))) - angle(clamped(bin_border(Quad(j))));
    return as_double(quad_abs(seen) * range / Quad(a_.range_spacing_m));
  }
  /// Whether the bin and so many to each side lie on the plane altogether.
  bool inside(int j, int margin = 1) const {
    return bin_border(Quad(j - margin)) > near_ && bin_border(Quad(j + 1 + margin)) < far_;
  }
  /// Whether neither the bin nor so many of its neighbours see anything of it.
  bool outside(int j, int margin = 1) const {
    return bin_border(Quad(j + 1 + margin)) < near_ || bin_border(Quad(j - margin)) > far_;
  }

 private:
  KnownPlane(const Acquisition& a, bool level, Quad perpendicular) : a_(a), level_(level), perpendicular_(perpendicular) {}

  Quad bin_border(Quad j) const { return (j - Quad(a_.n_range) / 2) * Quad(a_.range_spacing_m); }
  Quad clamped(Quad offset) const { return offset < near_ ? near_ : offset > far_ ? far_ : offset; }
  Quad angle(Quad offset) const {
    const Quad ratio = perpendicular_ / (offset + Quad(a_.slant_range_m));
    return level_ ? quad_acos(ratio) : quad_asin(ratio);
  }
  void set_ends(Quad first, Quad last) {
    const auto offset = [&](Quad along) {
      return quad_sqrt(perpendicular_ * perpendicular_ + along * along) - Quad(a_.slant_range_m);
    };
    near_ = std::min(offset(first), offset(last));
    far_ = std::max(offset(first), offset(last));
  }

  Acquisition a_;
  bool level_;
  Quad perpendicular_, near_ = 0, far_ = 0;
};

/// Where a plane of some bins of range lies, if the radar can see it from where it stands.
struct PlaneExtent {
  double height_m, half_m;
};
inline std::optional<PlaneExtent> roof_of_bins(const Acquisition& a, double n_bins) {
  const double half_m = 0.5 * n_bins * a.range_spacing_m / std::sin(a.incidence_rad);
  const double height_m = 3.0 * a.range_spacing_m;
  const bool before_nadir = half_m < 0.8 * a.slant_range_m * std::sin(a.incidence_rad);
  if (!before_nadir || height_m > 0.5 * a.altitude_m()) return std::nullopt;
  return PlaneExtent{height_m, half_m};
}
inline std::optional<PlaneExtent> wall_of_bins(const Acquisition& a, double n_bins) {
  const double height_m = n_bins * a.range_spacing_m / std::cos(a.incidence_rad);
  if (height_m > 0.8 * a.altitude_m()) return std::nullopt;
  return PlaneExtent{height_m, 0.0};
}

/// Worst relative error of the bins inside a plane, in the row in the middle; bins outside must be empty.
inline double worst_error(const Image<float>& image, const KnownPlane& plane, int margin = 1) {
  const int i = image.n_azimuth() / 2;
  double worst = 0.0;
  for (int j = 0; j < image.n_range(); ++j) {
    if (plane.outside(j, margin)) {
      worst = worse(worst, double(image(i, j)));
    } else if (plane.inside(j, margin)) {
      worst = worse(worst, std::abs(double(image(i, j)) / plane.beta0(j) - 1.0));
    }
  }
  return worst;
}

inline bool sound(const Image<float>& image) {
  return std::all_of(image.pixels().begin(), image.pixels().end(),
                     [](float p) { return std::isfinite(p) && p >= 0.0f; });
}

inline std::string text_of(const Acquisition& a) {
  char text[160];
  std::snprintf(text, sizeof text, "range %.3g m, pitch %.3g, spacing %.3g x %.3g m", a.slant_range_m,
                deg_from_rad(a.incidence_rad), a.azimuth_spacing_m, a.range_spacing_m);
  return text;
}

/// A sheet turned like the radar's azimuth, relative to the aim point: across is along track.
inline Scene sheet_facing(const Acquisition& a, const glm::dvec3& corner, const glm::dvec3& across,
                          const glm::dvec3& up_or_away, Material material = matte()) {
  const double c = std::cos(a.azimuth_rad), s = std::sin(a.azimuth_rad);
  const auto turned = [&](const glm::dvec3& p) { return glm::dvec3(c * p.x + s * p.z, p.y, -s * p.x + c * p.z); };
  Scene scene = empty_scene(std::move(material));
  add_sheet(scene, a.aim_m + turned(corner), turned(across), turned(up_or_away));
  return scene;
}
inline double half_along_m(const Acquisition& a) {
  return 0.5 * a.n_azimuth * a.azimuth_spacing_m + 5.0 * std::max(a.azimuth_spacing_m, a.range_spacing_m);
}
inline Scene roof_scene(const Acquisition& a, const PlaneExtent& e) {
  const double half_m = half_along_m(a);
  return sheet_facing(a, {-half_m, e.height_m, e.half_m}, {2.0 * half_m, 0.0, 0.0}, {0.0, 0.0, -2.0 * e.half_m});
}
inline Scene wall_scene(const Acquisition& a, const PlaneExtent& e) {
  const double half_m = half_along_m(a);
  return sheet_facing(a, {-half_m, 0.0, 0.0}, {2.0 * half_m, 0.0, 0.0}, {0.0, e.height_m, 0.0});
}

}  // namespace sarnerf::test
