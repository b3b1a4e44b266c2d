// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "appearance.h"
#include "layers/layer_row.h"
#include "plan.h"
#include "surface/slice.h"

namespace sarnerf {

/// Where a slice's plane cuts a triangle, as an interval of fractional ray indices: ray k lies at k, and an
/// outline seen between rays k and k + 1 lies between these values. The section is exact, so that the outline of
/// a face is known far more accurately than the spacing of the rays.
class TriangleSections {
 public:
  TriangleSections(const ViewRays& rays, std::span<const glm::vec3> vertices_m,
                   std::span<const glm::uvec3> triangles, const glm::dvec3& scene_origin_m);

  /// Empty when the plane at the along-track coordinate misses the triangle.
  std::optional<std::pair<double, double>> rays_of(std::uint32_t triangle, double along_m) const;

 private:
  std::span<const glm::vec3> vertices_m_;
  std::span<const glm::uvec3> triangles_;
  RadarFrame frame_;
  glm::dvec3 scene_from_aim_m_;
  double slant_range_m_;
  Fan fan_;
};

/// Destination of the layers, and the components of the triangles.
struct LayerSink {
  LayerRow* row = nullptr;  ///< null: no layers
  std::span<const Component> component;  ///< per triangle given to the tracer
};

/// One planar run of a slice, as it is deposited in the image: samples [first, last], extended by the fractions
/// `before` and `after` of a ray step.
struct SliceRun {
  std::size_t first = 0, last = 0;
  double before = 0.0, after = 0.0;
  double mass = 0.0;
  double smear = 0.0;
};

/// Adds a run to the layers, split where triangles of different components lie in one plane. A run of the mesh
/// hides the reference plane even if it scatters nothing.
void add_run(const ViewRays& rays, const Slice& slice, const SliceRun& run, const LayerSink& sink);

/// The scene data that reconstruction needs.
struct SliceScene {
  const ViewRays& rays;
  const TriangleSections& sections;
  const AppearanceTable& appearances;
  const Appearance* ground = nullptr;  ///< null without a ground
};

/// Deposits one slice into its row of range bins, in units of γ times ray steps.
///
/// Rays are samples of the piecewise linear curve in which the slice's plane cuts the scene. Between
/// two rays on one plane the curve is known. Between rays on different planes it is reconstructed: if the planes
/// intersect there, they meet at a corner (roof and wall, wall and ground); otherwise the nearer face ends where
/// its triangle ends, and the farther one begins there. Each planar run is deposited as one trapezoid
/// over the ranges it spans, so that the image has neither gaps nor aliases, and flat scenes need few rays.
///
/// Both end samples of the slice must be set: to nothing, or to the ground. Layers, if asked for, get every
/// run of the image, and also those that scatter nothing.
void deposit_slice(const Slice& slice, const SliceScene& scene, std::span<double> bins,
                   const LayerSink& layers = {});

/// The infinite ground plane in one view. Its range depends on the ray angle alone, so that one table
/// serves every row. Outside the rays that may meet the mesh, the image of a uniform ground is known in closed form.
class GroundPlane {
 public:
  GroundPlane(const ViewRays& rays, const Appearance& appearance, double height_m);

  const Appearance& appearance() const { return appearance_; }

  /// Whether the plane has no texture, so that it needs no rays of its own.
  bool uniform() const { return !appearance_.checker; }

  /// Puts the ground into all samples of a traced slice, ends included, that have no hit in front of it.
  void fill(Slice& slice) const;

  /// Makes a slice that meets nothing but the ground: rays [first, first + n) and both ends. Its along_m
  /// and width_m must be set.
  void fill_alone(int first, int n, Slice& slice) const;

  /// Adds the power of a uniform ground outside the ray indices [gap_first, gap_last], in units of γ
  /// times ray steps like deposit_slice(), times `weight`. An empty gap (first ≥ last) means everywhere.
  void deposit_outside(double gap_first, double gap_last, double weight, std::span<double> bins) const;

 private:
  std::size_t index(int k) const { return static_cast<std::size_t>(k + 1); }
  void put(Slice& slice, std::size_t m, int k) const;

  const ViewRays& rays_;
  Appearance appearance_;
  std::vector<float> bin_, bin_per_ray_, gamma_;  ///< [n_el + 2], from k = −1
  std::vector<float> coplanar_bins_;              ///< [n_el + 2] a mesh up to this much behind the ground still hides it
  std::vector<double> border_ray_;                ///< [n_range + 1] ray index at each bin border
  std::vector<double> bin_gamma_;                 ///< [n_range] mean γ over the bin's angles
};

}  // namespace sarnerf
