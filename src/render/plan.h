// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sarnerf/geometry/ray_grid.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/scene.h"
#include "sarnerf/scene/vdb_scene.h"
#include "sarnerf/trace/ray_tracer.h"

namespace sarnerf {

/// The rays of one view in the form that tracing and deposit use: one array per component. Origins lie just
/// before the scene's box instead of at the radar, in the scene frame (world axes, origin at
/// `scene_origin_m`). Made once per view; a slice only adds its along-track offset.
struct ViewRays {
  ViewRays(const Acquisition& acquisition, const Fan& fan, const glm::dvec3& scene_origin_m,
           std::pair<double, double> range_offsets_m);

  RayGrid grid;
  double start_offset_m;  ///< range offset s = t − r of all ray origins
  float far_m;            ///< length of the rays

  std::vector<double> origin_x, origin_y, origin_z;           ///< [n_el] on the row a = 0
  std::vector<float> direction_x, direction_y, direction_z;   ///< [n_el] d_k
  std::vector<float> turn_x, turn_y, turn_z;                  ///< [n_el] ∂d_k/∂δ

  /// Point of the scene frame at along-track coordinate a and range offset s.
  glm::dvec3 scene_point(double a_m, double s_m, int k) const {
    const auto n = static_cast<std::size_t>(k);
    return glm::dvec3(origin_x[n], origin_y[n], origin_z[n]) + a_m * grid.frame().h +
           (s_m - start_offset_m) * grid.direction(k);
  }

  /// Bin coordinate x of a range offset: bin j covers [j, j + 1).
  double bin_coordinate(double s_m) const {
    const Acquisition& a = grid.acquisition();
    return s_m / a.range_spacing_m + 0.5 * a.n_range;
  }
};

/// The scene's box as seen in one acquisition. It is used to leave out rays that miss the box, and rays that
/// meet only its part beyond the last range bin. The part nearer than bin 0 is kept: it casts shadows.
class VisibleExtent {
 public:
  VisibleExtent(const Acquisition& acquisition, const Box& box);

  /// Interval of ray angles (rad) that meet the visible part of the box at along-track coordinates in
  /// [first, last] (m); empty when none do. Too wide by less than a ray.
  std::optional<std::pair<double, double>> angles(double first_along_m, double last_along_m) const;

  /// Along-track extent of the box (m, relative to the aim point).
  std::pair<double, double> along_track_m() const { return {corner_min_.x, corner_max_.x}; }

  /// Range offsets s = t − r (m) between which all of the box lies.
  std::pair<double, double> range_offsets_m() const { return range_offsets_m_; }

 private:
  Acquisition acquisition_;
  std::array<glm::dvec3, 8> corners_;  ///< (along h, along v, along k) relative to the aim point
  glm::dvec3 corner_min_{0.0}, corner_max_{0.0};
  std::pair<double, double> range_offsets_m_{0.0, 0.0};
  double last_depth_m_ = 0.0;  ///< along k; what lies deeper is beyond the last bin
};

/// Ray indices [first, first + count).
struct RayRange {
  int first = 0;
  int count = 0;
};

/// The rays inside the interval of angles (rad), and one more on each side; none without angles.
RayRange rays_inside(const Fan& fan, const std::optional<std::pair<double, double>>& angles);

/// Chooses fan and sub-rows for one view and predicts time and memory; renders nothing. `media_m` is the
/// box of the translucent solids, empty without any.
ViewPlan plan_view(const Scene& scene, const Box& media_m, const Acquisition& acquisition,
                   const Sampling& sampling);

/// The same for the voxel engine. `scene` contains the volume's box instead of a mesh.
ViewPlan plan_voxel_view(const Scene& scene, const Volume& volume, const Acquisition& acquisition,
                         const Sampling& sampling);

/// What the rays met in a view whose image is all zero.
struct BlankEvidence {
  std::uint64_t n_hits = 0;  ///< hits on opaque faces, or rays that met a volume
  bool volume = false;       ///< voxels instead of a mesh with materials
};

/// Why the image is blank, and what to do: one line. Every blank image comes with this warning.
std::string explain_blank(const Scene& scene, const ViewPlan& plan, const BlankEvidence& evidence);

}  // namespace sarnerf
