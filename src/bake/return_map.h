// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "learned_volume.h"
#include "sarnerf/core/monitor.h"
#include "sarnerf/geometry/ray_grid.h"

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

}  // namespace sarnerf
