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

/// Where the rays of one view meet matter: the range at which half of what a ray returns has come back. Of learned
/// matter, which is fog some voxels thick around a surface, that is what images say of the surface: extinction alone
/// says less, since its outer parts may be dark.
///
/// A ray meets matter where more than half of it is stopped, or where it returns more than a quarter of what rays of
/// the scene mostly return: a field may have learned to be bright rather than opaque.
class ReturnMap {
 public:
  ReturnMap(const Acquisition& view, const Box& box_m, double spacing_m);

  /// Signed distance (m) along the ray through a point, in the volume's frame: how far in front of what the ray meets
  /// the point lies; +∞ where the ray meets nothing. NaN where the swath does not hold the point.
  double distance_m(const glm::dvec3& point_m) const;

  /// Whether a ray beside a point meets something within `near_m` of it, along the ray.
  bool meets_near(const glm::dvec3& point_m, double near_m) const;

  /// What a ray returned, in the volume's frame.
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
    float meets = 0.0f;           ///< ½ and more: meets matter
  };

  /// Where a point lies among the rays: that of less than it along track and in angle, and how far it is to the next.
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

/// Of views relative to the aim point, rays `spacing_m` apart and cut into segments of three quarters of that at most. Cost: that of rendering so many rays, views in parallel.
std::vector<ReturnMap> return_maps(const LearnedVolume& volume, const Occupancy& occupancy,
                                   std::span<const Acquisition> views, double spacing_m, const Monitor& monitor);

/// At most `n` of the views, spread over them.
std::vector<Acquisition> spread_views(std::span<const Acquisition> views, std::size_t n);

/// The body behind the surfaces that views see, by what they agree on (return_map.h).
///
/// 0.5 lies on the surface, and values fall from 1 to 0 within a voxel to either side of it, so that a mesh is smoother
/// than voxels. Below `floor_m` (relative to the aim point) nothing is full. Grid coordinates are those of the lattice;
/// insides are tiles; points that no view's map holds are empty. Cost: some 30 ns a view and voxel near the surface and where
/// views differ; elsewhere one of 64 voxels is tested.
openvdb::FloatGrid::Ptr solid_occupancy(std::span<const ReturnMap> maps, double agreeing_share, const Occupancy& matter,
                                        const GridTransform& of_matter, const VoxelLattice& lattice,
                                        std::optional<double> floor_m, const Monitor& monitor);

/// Height (relative to the aim point) at which what stands there ends below, as far as it is seen: where the power that
/// comes from a layer falls below half of that from the five voxels above it. Nothing where nothing returns power.
std::optional<double> bottom_of_returns_m(std::span<const ReturnMap> maps, double voxel_m);

/// Matter itself: 0.5 where the volume's extinction is `threshold` (1/m), in proportion to it between 0 and 1.
openvdb::FloatGrid::Ptr shell_occupancy(const LearnedVolume& volume, double threshold_per_m,
                                        std::optional<double> floor_m);

/// Takes out of a body what no view sees into and no seen surface bounds, as the space under a vehicle, between its
/// wheels. Views leave it full, since none looks in; yet its sides are where rays happen to end, and nothing returns
/// from there.
///
/// Points `step_m` apart, about a learned voxel, are tested in 16 horizontal directions: does the way out of the body end at
/// a surface that returns power to a tenth of the views or more? Where it does in fewer than half of the directions, the point
/// is taken out, unless matter is left below it. Two exceptions: a slice of whose sides more than 70 % are such surfaces stays
/// whole, since the rest is wall that returns little, and so does a part of whose lowest sides less than a twentieth is: it
/// stands on something that no view sees.
///
/// `occupancy` is of the frame of the maps through `to_volume`, and 1 in matter. A surface returns power where a map's return
/// lies within three quarters of a step. Memory: a byte and a float for each point of the body's box.
void leave_out_unbounded(openvdb::FloatGrid& occupancy, const GridTransform& to_volume, std::span<const ReturnMap> maps,
                         double step_m, const Monitor& monitor);

/// What views say together of a place: empty when a share of those that hold it see it in front of what their rays meet,
/// or past it; else full, since nobody sees inside of opaque matter. A single view may err. One per thread.
class ViewAgreement {
 public:
  ViewAgreement(std::span<const ReturnMap> maps, double agreeing_share, double voxel_m)
      : maps_(maps), agreeing_share_(agreeing_share), voxel_m_(voxel_m) {}

  /// 1 in matter and behind it, 0 in front; ½ on the surface, over two voxels. 0 where no view looks.
  float occupancy(const glm::dvec3& point_m);

 private:
  std::span<const ReturnMap> maps_;
  double agreeing_share_, voxel_m_;
  std::size_t first_ = 0, begin_ = 0;
  std::vector<double> distances_;
};

/// Share of the views that must agree on what is empty: a tenth, or four tenths where a tenth errs.
///
/// A tenth keeps undercuts, into which few views see. But of a smooth wall that is dim beside what it bears, grazing
/// views learn nothing, and a tenth of them carve the house behind it. Then much of the power seems to come out of empty
/// space: more than a tenth of it is returned where the body does not begin within two and a half learned voxels behind.
/// If four tenths leave little of that, they are taken. Only power from above `floor_m` counts. Deterministic; 20,000 rays.
double agreeing_share(std::span<const ReturnMap> maps, double learned_voxel_m, std::optional<double> floor_m);

}  // namespace sarnerf
