// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>
#include "learned_volume.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/geometry/ray_grid.h"
#include "vdb/vdb_grids.h"

namespace sarnerf {

/// For each ray of one view, the slant range at which half of the ray's power has returned: its hit. A learned surface is
/// fog some voxels thick. This range locates the surface better than extinction alone, since outer parts of the fog may
/// be dark.
///
/// A ray hits something if more than half of it is absorbed, or if it returns more than a quarter of what the scene's
/// median ray returns: some fields are bright rather than opaque.
class ReturnMap {
 public:
  ReturnMap(const Acquisition& view, const Box& box_m, double spacing_m);

  /// Signed distance (m), along the ray, from a point in the volume's frame to the ray's hit: positive in front of the hit,
  /// +∞ if the ray hits nothing. NaN if the point is outside of the swath.
  double distance_m(const glm::dvec3& point_m) const;

  /// Whether one of the four rays around a point has a hit within `near_m` of it, along the ray.
  bool meets_near(const glm::dvec3& point_m, double near_m) const;

  /// Power that a ray returned, in the volume's frame.
  struct Return {
    glm::dvec3 point_m;    ///< at half of the power
    glm::dvec3 direction;  ///< of the ray, away from the radar
    float power;
  };
  void append_returns(std::vector<Return>& returns) const;

 private:
  friend std::vector<ReturnMap> return_maps(const LearnedVolume&, const Occupancy&, std::span<const Acquisition>, double,
                                            const Monitor&);
  struct Ray {
    float range_offset_m = 0.0f;  ///< s at half of the power
    float returned = 0.0f;        ///< Σ γ T (1 − e^−x)
    float meets = 0.0f;           ///< ½ and more: the ray hits something
  };

  /// Position of a point among the rays: indices (i, k) of the ray below it along track and in angle, and fractions (u, v)
  /// of the steps to the next.
  struct Place {
    bool in_image = false, among_rays = false;
    int i = 0, k = 0;
    double u = 0.0, v = 0.0;
    double range_offset_m = 0.0;
  };
  Place place_of(const glm::dvec3& point_m) const;
  const Ray& ray(int i, int k) const { return map_[static_cast<std::size_t>(i * n_angles_ + k)]; }

  void look(const LearnedVolume& volume, const Occupancy& occupancy, const Box& box_m);

  Acquisition view_;
  RadarFrame frame_;
  RayGrid rays_;
  double spacing_m_, first_along_track_m_, first_angle_rad_ = 0.0;
  double rays_per_m_ = 0.0, rays_per_rad_ = 0.0;
  double half_swath_m_ = 0.0, half_depth_m_ = 0.0;  ///< of the image around the aim point
  int n_along_ = 0, n_angles_ = 0;
  std::vector<Ray> map_;  ///< [n_along, n_angles]
};

/// Maps of views relative to the aim point, with rays `spacing_m` apart, cut into segments of at most three quarters of
/// that. Cost: that of rendering so many rays, views in parallel.
std::vector<ReturnMap> return_maps(const LearnedVolume& volume, const Occupancy& occupancy,
                                   std::span<const Acquisition> views, double spacing_m, const Monitor& monitor);

/// At most `n` of the views, evenly spread over their order.
std::vector<Acquisition> spread_views(std::span<const Acquisition> views, std::size_t n);

/// Occupancy of the body behind the surfaces that views see, by ViewAgreement.
///
/// It is 0.5 on the surface, and falls from 1 to 0 within a voxel to either side of it, so that a mesh is smoother
/// than voxels. Below `floor_m` (relative to the aim point) nothing is full. Grid coordinates are those of the lattice.
/// The interior is stored as tiles. Points that no view's map contains are empty. Cost: some 30 ns a view and voxel in
/// occupied bricks and where views differ; elsewhere 27 points are tested for each brick of 512 voxels.
openvdb::FloatGrid::Ptr solid_occupancy(std::span<const ReturnMap> maps, double agreeing_share, const Occupancy& matter,
                                        const GridTransform& of_matter, const VoxelLattice& lattice,
                                        std::optional<double> floor_m, const Monitor& monitor);

/// Lowest visible height of the objects (relative to the aim point): where the power from a layer falls below half of the
/// mean over the five voxels above it. Empty if nothing returns power.
std::optional<double> bottom_of_returns_m(std::span<const ReturnMap> maps, double voxel_m);

/// Occupancy by extinction: 0.5 at `threshold_per_m`, proportional to the extinction between 0 and 1.
openvdb::FloatGrid::Ptr shell_occupancy(const LearnedVolume& volume, double threshold_per_m,
                                        std::optional<double> floor_m);

/// Removes from a body the space that no view sees into and no seen surface bounds, such as the space under a vehicle,
/// between its wheels. It is full only because no view sees into it. Its sides are only the ends of rays, and nothing
/// returns from there.
///
/// Points `step_m` apart, about a learned voxel, are tested in 16 horizontal directions: does the path out of the body end at
/// a surface that returns power to at least a tenth of the views? If it does in fewer than half of the directions, the point
/// is removed, unless something full is left below it. There are two exceptions. A horizontal slice with more than 70 % of its
/// sides seen stays whole, since the rest is dark wall. A part with less than a twentieth of its lowest sides seen stays
/// whole, since it stands on something that no view sees.
///
/// `occupancy` is 1 inside; `to_volume` gives its voxels' positions in the frame of the maps. A surface returns power to a
/// view if a hit of its map lies within three quarters of a step. Memory: 7 bytes for each point of the body's box, and 12
/// for each point of its largest connected part.
void leave_out_unbounded(openvdb::FloatGrid& occupancy, const GridTransform& to_volume, std::span<const ReturnMap> maps,
                         double step_m, const Monitor& monitor);

/// The views' agreement about a point. It is empty if a given fraction of the views that contain it see it in front of their
/// ray's hit, or on a ray without a hit; else full, since views do not see inside opaque material. A single view may err.
/// One per thread.
class ViewAgreement {
 public:
  ViewAgreement(std::span<const ReturnMap> maps, double agreeing_share, double voxel_m)
      : maps_(maps), agreeing_share_(agreeing_share), voxel_m_(voxel_m) {}

  /// 1 behind the surface, 0 in front, ½ on it, linear over two voxels. 0 outside of all swaths.
  float occupancy(const glm::dvec3& point_m);

 private:
  std::span<const ReturnMap> maps_;
  double agreeing_share_, voxel_m_;
  std::size_t first_ = 0, begin_ = 0;
  std::vector<double> distances_;
};

/// Fraction of the views that must agree that a point is empty: a tenth, or four tenths where a tenth is too few.
///
/// A tenth preserves undercuts, into which few views see. But grazing views learn nothing of a smooth wall that is dim
/// compared with what it supports, and a tenth of them carve the house behind it. Then more than a tenth of the power comes
/// from points without a body two and a half learned voxels behind them. If four tenths reduce this fraction to 0.07, they
/// are used. Only power from at least a learned voxel above `floor_m` counts. Deterministic; at most 20,000 rays.
double agreeing_share(std::span<const ReturnMap> maps, double learned_voxel_m, std::optional<double> floor_m);

}  // namespace sarnerf
