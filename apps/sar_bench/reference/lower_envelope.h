// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "sarnerf/geometry/acquisition.h"
#include "sarnerf/scene/scene.h"

namespace sarnerf {

/// The cut of a slice's plane through a flat face: a straight line between two points of the plane, which contains
/// all rays of the slice. Points have a depth along k and a coordinate along v, relative to the aim point (m). A ray
/// is identified by the tangent of its angle δ. 1 / (r + depth) is linear in this tangent along any line, so two
/// lines swap their order at most once.
struct SliceLine {
  double first, last;               ///< tangents of the rays through its ends, first < last
  double depth_m, across_m;         ///< its end at `first`: along k, along v
  double depth_step_m, across_step_m;  ///< from there to its other end
  std::uint32_t face;

  /// Fraction of the way along the line at which the ray meets it; `r` is the aim point's slant range (m). No
  /// cancellation for far radars: (r + depth) · tangent is as small as the scene.
  double fraction_at(double tangent, double r) const {
    const double f = ((r + depth_m) * tangent - across_m) / (across_step_m - depth_step_m * tangent);
    return std::clamp(f, 0.0, 1.0);
  }
  double depth_at(double tangent, double r) const { return depth_m + fraction_at(tangent, r) * depth_step_m; }
};

/// The scene's vertices as the radar of a view sees them: along h, along v, along k, relative to the aim
/// point (m). Throws GeometryError for a scene that reaches behind the radar.
std::vector<glm::dvec3> radar_vertices(const Scene& scene, const Acquisition& view);

/// Triangles of a scene, sorted by the image rows that they are part of.
class SlicedFaces {
 public:
  /// `vertices_m`: radar_vertices(); `triangles`: indices into scene.mesh.triangles. Scene and vertices must
  /// outlive it.
  SlicedFaces(const Scene& scene, std::span<const glm::dvec3> vertices_m,
              const std::vector<std::uint32_t>& triangles, const Acquisition& view);

  /// Replaces `lines` by the cuts of the plane at along-track coordinate a, inside row i; `face` is the index of the triangle
  /// in the mesh. The ends of neighbouring cuts are equal to the last bit, so that no ray passes between them.
  void cut(int i, double along_m, std::vector<SliceLine>& lines) const;

 private:
  const Scene& scene_;
  std::span<const glm::dvec3> vertices_m_;
  double slant_range_m_;
  std::vector<std::vector<std::uint32_t>> of_row_;
};

/// Converts points of a slice's plane to ranges and world points, in double precision throughout.
struct SliceFrame {
  explicit SliceFrame(const Acquisition& view)
      : radar(radar_frame(view)),
        aim_m(view.aim_m),
        r(view.slant_range_m),
        bins_per_m(1.0 / view.range_spacing_m),
        first_bin(0.5 * view.n_range) {}

  /// Range in bin coordinates (bin j covers [j, j + 1)) of the point at a depth along a ray. Avoids the cancellation
  /// of subtracting the aim point's range from another range.
  double bin_at(double tangent, double depth_m) const {
    const double across_m = (r + depth_m) * tangent, range_m = std::hypot(r + depth_m, across_m);
    const double offset_m = (depth_m * (2.0 * r + depth_m) + across_m * across_m) / (range_m + r);
    return offset_m * bins_per_m + first_bin;
  }
  double bin_at(const SliceLine& line, double tangent) const { return bin_at(tangent, line.depth_at(tangent, r)); }

  glm::dvec3 world_m(double along_m, const SliceLine& line, double tangent) const {
    const double depth_m = line.depth_at(tangent, r);
    return aim_m + (along_m * radar.h + (r + depth_m) * tangent * radar.v + depth_m * radar.k);
  }

  /// Angle (rad) between two rays, exact for close ones.
  static double angle_between(double first, double last) { return std::atan((last - first) / (1.0 + first * last)); }

  RadarFrame radar;
  glm::dvec3 aim_m;
  double r;  ///< slant range of the aim point (m)
  double bins_per_m, first_bin;
};

/// An interval of rays, by the tangents of their angles, that all meet the same line first.
struct VisiblePiece {
  double first, last;
  std::uint32_t line;  ///< index into the lines
};

/// Determines, for every ray, which of a slice's lines is nearest to the radar. Between neighbouring ends of lines,
/// all rays meet the same lines. A line that is nearest at both borders of an interval is nearest all over it;
/// otherwise the interval is divided where the two nearest lines swap. Lines may cross, touch and coincide; of lines
/// nowhere more than a nanometre apart, either may be chosen.
/// Cost: n log n for n ends, and a few ns for each line of each interval.
class LowerEnvelope {
 public:
  explicit LowerEnvelope(double slant_range_m) : r_(slant_range_m) {}

  /// Replaces `pieces`, in order of angle, without rays that meet no line.
  void find(std::span<const SliceLine> lines, std::vector<VisiblePiece>& pieces);

 private:
  struct End {
    double tangent;
    std::uint32_t line;
    bool begins;
  };

  /// The nearest of the active lines, at a ray that all of them meet.
  std::uint32_t nearest(double tangent) const;
  void divide(double first, std::uint32_t at_first, double last, std::uint32_t at_last, int depth);
  void add(double first, double last, std::uint32_t line);
  double depth_at(std::uint32_t line, double tangent) const { return lines_[line].depth_at(tangent, r_); }

  double r_;
  std::span<const SliceLine> lines_;
  std::vector<VisiblePiece>* pieces_ = nullptr;
  std::vector<End> ends_;
  std::vector<std::uint32_t> active_;
};

/// Tangent, between two rays, at which lines a and b cross. Line a is nearer by `before_m` at the first ray, line b
/// by `behind_m` at the last; neither is negative, and not both are zero. The depths are those of a and b from the
/// radar, at each of the two rays.
double crossing(double first, double last, double before_m, double behind_m, glm::dvec2 first_depths_m,
                glm::dvec2 last_depths_m);

}  // namespace sarnerf
